# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Loads that are held out are predicted by the others, and their errors are reported by force and place."""
import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
from tactile_perception.calibration.residuals import outliers  # noqa: E402
from tactile_perception.taxel.pressure import TaxelArray  # noqa: E402
from tactile_perception.taxel.response import Loop  # noqa: E402
from tactile_perception.taxel.calibration import Loads, find_loop, held_out_errors  # noqa: E402
from tactile_perception.taxel.tools import held_out_residuals  # noqa: E402


def loads_of(changes, forces, times=None, when=None):
    """Loads of one recording, a second apart, each a level of its own."""
    count = len(forces)
    return Loads(changes, np.asarray(forces, float), None, [], when or [''] * count, np.arange(1.0, count + 1) if times is None else times,
                 np.zeros(count, int), np.arange(count))


def test_errors_are_reported_by_force_and_where_loads_differ_in_place_over_the_pad():
    changes = np.zeros((6, 5, 5))
    changes[:, 2, 2] = 1
    array, forces = TaxelArray(5, 5, 1e-3), np.arange(1.0, 7)
    errors = np.array([0.01, -0.01, 0.02, -0.02, 0.01, 0.5])
    loads = loads_of(changes, forces, when=[f'bag at {k} s' for k in range(6)])
    found, = held_out_residuals(loads, array, errors)
    assert found.value == pytest.approx(100 * errors) and found.place[:, 0] == pytest.approx(forces)
    assert outliers([found]) == ['bag at 5 s: force error 50 %, the median is 1.5 %']
    changes[0] = np.roll(changes[0], 2, axis=1)
    _, over = held_out_residuals(loads, array, errors)
    assert over.place[0] == pytest.approx([2.0, 0.0]) and over.place[1] == pytest.approx([0.0, 0.0])


def test_a_loop_between_rising_and_falling_loads_is_found_and_undone():
    up = np.repeat([5.0, 10, 20, 40, 60, 80], 3)
    pascal, times = 1e3 * np.concatenate([up, up[::-1]]), np.arange(1, 37) * 0.1
    true = Loop(0.5, 5000.0, 0.0, 0.6)
    seen = true.shown(pascal, np.diff(times, prepend=-1e6))
    changes = np.zeros((36, 8, 8), np.float32)
    changes[:, 1:7, 1:7] = (seen / 450)[:, None, None]
    array, given = TaxelArray(8, 8, 1e-3), loads_of(changes, pascal * 36e-6, times)
    loop, shown = find_loop(given, array, None)
    assert loop.width(8e4) == pytest.approx(true.width(8e4), rel=0.25) and loop.relaxation == pytest.approx(0.6, rel=0.7)
    assert shown == pytest.approx(seen * 36e-6, rel=0.1)
    with_loop = np.abs(held_out_errors(given, array, None, loop, shown))
    without = np.abs(held_out_errors(given, array, None, Loop(), given.forces))
    assert np.nanmedian(with_loop) < 0.4 * np.nanmedian(without)


def shown_by_many_memories(pascal, step_s, rng):
    """What a layer shows (N,) of loads (N,), Pa, every step_s: springs that slide and relax (Prandtl), and Kelvin elements, at random."""
    sliders = 10**rng.uniform(2.8, 4.7, 6), rng.dirichlet(np.ones(6)) * rng.uniform(0.05, 0.2), 10**rng.uniform(-0.5, 1.3, 6)
    kelvin_s, kelvin = np.geomspace(0.03, 30, 7), rng.dirichlet(np.full(7, 2.0)) * rng.uniform(0.04, 0.16)
    spring, late, found = np.zeros(6), np.zeros(7), []
    for load, change in zip(pascal, np.diff(pascal, prepend=0.0)):
        spring = np.clip(spring * np.exp(-step_s / sliders[2]) + change, -sliders[0], sliders[0])
        late += (load - late) * -np.expm1(-step_s / kelvin_s)
        found.append(load - sliders[1] @ spring + kelvin @ (late - load))
    return np.array(found)


@pytest.mark.parametrize('seed', range(300, 306))
def test_weights_on_a_layer_with_many_memories(seed):
    """By frames under and after rising and falling loads, from an eighth of the largest on."""
    rng = np.random.default_rng(seed)
    up = [1e4, 2e4, 4e4, 8e4]
    pascal = np.repeat([*up, *up[::-1], 0.0, 0.0], 12)
    changes = np.zeros((len(pascal), 8, 8))
    changes[:, 1:7, 1:7] = (shown_by_many_memories(pascal, 0.05, rng) / 450 + rng.normal(0, 0.05, len(pascal)))[:, None, None]
    array, given = TaxelArray(8, 8, 1e-3), loads_of(changes, pascal * 36e-6, np.arange(1, len(pascal) + 1) * 0.05)
    loop, shown = find_loop(given, array, None)
    errors = held_out_errors(given, array, None, loop, shown)
    assert np.isnan(errors[pascal == 0]).all() and np.nanmean(np.abs(errors)) < 0.02 and np.nanmax(np.abs(errors)) < 0.08

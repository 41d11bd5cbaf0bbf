# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.psd.creep import Creep, CreepCorrection, fit_creep

COVER = Creep(0.06, 0.03)


def unit(angle):
    """Unit normals (N, 3) along a bent way."""
    angle = np.asarray(angle)
    rows = np.stack([np.sin(angle), 0.5 * np.sin(2 * angle), np.cos(angle)], axis=-1)
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def seen(normals, period, creep):
    """What a standard linear solid shows of normals (N, 3) under a constant load, by small steps of Euler's method."""
    place, weight, rows = np.zeros(3), 0.0, []
    for normal in normals:
        place, weight = place + (normal - place) * period / creep.seconds, weight + (1 - weight) * period / creep.seconds
        rows.append(((1 - creep.share) * normal + creep.share * place) / (1 - creep.share + creep.share * weight))
    return np.array(rows)


def test_a_way_is_told_without_the_creep():
    period, angles = 1e-5, 0.8 * np.sin(np.linspace(0, 20, 40000))
    true = unit(angles)
    shown = seen(true, period, COVER)
    correction, errors, late = CreepCorrection(COVER), [], []
    for k in range(0, len(true), 100):
        found = correction.update(1, shown[k], k * period)
        errors.append(np.linalg.norm(found - true[k]))
        late.append(np.linalg.norm(shown[k] - true[k]))
    assert max(late) > 0.02 and max(errors) < 3e-4


def test_a_contact_that_rests_stays_as_it_is():
    correction = CreepCorrection(COVER)
    for k in range(50):
        assert correction.update(1, unit(0.4), 0.004 * k) == pytest.approx(unit(0.4), abs=1e-12)


def test_a_new_contact_and_a_clock_set_back_begin_anew_and_nan_is_passed_on():
    correction = CreepCorrection(COVER)
    correction.update(1, unit(0.0), 1.0)
    moved = correction.update(1, unit(0.3), 1.01)
    assert np.linalg.norm(moved - unit(0.3)) > 1e-3
    assert np.isnan(correction.update(1, np.full(3, np.nan), 1.02)).all()
    assert np.linalg.norm(correction.update(1, unit(0.3), 1.02) - unit(0.3)) > 1e-4, 'it goes on after it'
    assert list(correction.update(2, unit(0.7), 1.03)) == list(unit(0.7))
    assert list(correction.update(2, unit(0.1), 0.5)) == list(unit(0.1))


def presses(creep, count=40, noise=0.01, wobble=0.0, seconds=0.25, period=1e-3, seed=0):
    """Lights of presses that rise within 20 ms and rest."""
    rng, times = np.random.default_rng(seed), np.arange(0, seconds, period)
    found = []
    for _ in range(count):
        level = rng.uniform(1, 5)
        load = level * np.clip(times / 0.02, 0, 1) * (1 + wobble * np.sin(2 * np.pi * (rng.uniform(2, 6) * times + rng.uniform())))
        late = np.zeros_like(load)
        for k in range(1, len(load)):
            late[k] = late[k - 1] + (load[k] - late[k - 1]) * period / creep.seconds
        found.append((period, (1 - creep.share) * load + creep.share * late + noise * level * rng.standard_normal(len(load))))
    return found


@pytest.mark.parametrize('creep', [COVER, Creep(0.03, 0.06), Creep(0.04, 0.012)])
def test_presses_that_rest_tell_the_creep(creep):
    found = fit_creep(presses(creep))
    assert found.share == pytest.approx(0.8 * creep.share, rel=0.15) and found.seconds == pytest.approx(creep.seconds, rel=0.2)


@pytest.mark.parametrize('lights', [
    presses(Creep(0.0, 0.03)), presses(COVER, count=5), presses(COVER, seconds=0.06), presses(COVER, wobble=0.1), [],
    [(1e-3, np.full(300, np.nan))] * 9, [(1e-3, np.zeros(300))] * 9, [(1e-3, -np.ones(300))] * 9],
    ids=['none', 'few', 'short', 'by hand', 'nothing', 'unknown', 'dark', 'negative'])
def test_what_does_not_show_it_tells_none(lights):
    assert fit_creep(lights) is None

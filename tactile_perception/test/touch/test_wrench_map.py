# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.touch.wrench_map import WrenchMap, fit_wrench_map

REST = np.stack(np.meshgrid(np.linspace(-1, 1, 11), np.linspace(-0.8, 0.8, 9)), -1).reshape(-1, 2)


def press(place, push, drag, twist=0.0, noise=1e-5, seed=0):
    """A field as of a tip that pushes dots away from its place, drags them along and turns them, and the wrench that does it."""
    off = REST - place[:2]
    bell = np.exp(-np.sum(off**2, axis=1) / 0.4)[:, None]
    size = push ** 0.8
    shift = size * bell * off + bell * np.array(drag) + twist * bell * off[:, ::-1] * [-1, 1]
    force = np.array([5 * drag[0], 5 * drag[1], -push])
    moment = np.cross(place, force) + [0, 0, 3 * twist]
    return shift + np.random.default_rng(seed).normal(0, noise, REST.shape), np.concatenate([force, moment])


def recording(drags=True, seed=3, count=120):
    rng = np.random.default_rng(seed)
    places = np.column_stack([rng.uniform(-0.5, 0.5, (count, 2)), np.zeros(count)])
    made = [press(place, rng.uniform(0.05, 0.5), rng.normal(0, 0.02, 2) * drags, rng.normal(0, 0.03) * drags, seed=k)
            for k, place in enumerate(places)]
    return np.array([shift for shift, _ in made]), np.array([wrench for _, wrench in made]), places


@pytest.fixture(scope='module')
def numbers():
    return fit_wrench_map(REST, *recording())


def errors(numbers, with_place):
    shifts, wrenches, places = recording(seed=9, count=40)
    told = np.array([WrenchMap(numbers).wrench(REST, *pair) for pair in zip(shifts, places if with_place else [None] * 40)])
    off = told - wrenches
    return [np.median(np.linalg.norm(off[:, part], axis=1) / np.linalg.norm(wrenches[:, part], axis=1)) for part in (slice(3), slice(3, 6))]


def test_wrenches_of_other_presses_and_drags_are_told(numbers):
    force, moment = errors(numbers, False)
    assert force < 0.02 and moment < 0.04
    assert numbers['held_out_force'] < 0.04 and all(numbers['told'])


def test_the_place_does_not_make_the_moment_worse(numbers):
    assert errors(numbers, True)[1] <= errors(numbers, False)[1]


def test_an_axis_that_was_not_excited_is_unknown():
    shifts, wrenches, places = recording(drags=False)
    wrench = WrenchMap(fit_wrench_map(REST, shifts, wrenches, places)).wrench(REST, shifts[0], places[0])
    assert np.isnan(wrench).tolist() == [True, True, False, False, False, True]
    assert wrench[2] == pytest.approx(wrenches[0, 2], rel=0.03)


def test_without_displacement_there_is_no_wrench(numbers):
    assert np.abs(WrenchMap(numbers).wrench(REST, np.zeros_like(REST))).max() == 0.0


def test_dots_that_are_not_seen_are_left_out(numbers):
    shift, wrench = press(np.array([0.2, 0.1, 0.0]), 0.3, (0.01, 0.0))
    shift[::7] = np.nan
    assert WrenchMap(numbers).wrench(REST, shift)[2] == pytest.approx(wrench[2], rel=0.04)
    shift[40:] = np.nan
    assert np.isnan(WrenchMap(numbers).wrench(REST, shift)).all()


def test_what_cannot_be_fitted_or_read_is_refused(numbers):
    shifts, wrenches, places = recording(count=5)
    with pytest.raises(BadCalibration, match='too few'):
        fit_wrench_map(REST, shifts, wrenches, places)
    with pytest.raises(BadArgument, match='disagree'):
        fit_wrench_map(REST, shifts, wrenches[:, :5], places)
    with pytest.raises(BadCalibration, match='calibrate anew'):
        WrenchMap({key: value for key, value in numbers.items() if key != 'scale'})
    with pytest.raises(BadCalibration, match='agree'):
        WrenchMap(numbers | {'told': [True]})

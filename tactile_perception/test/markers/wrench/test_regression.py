# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench is told of made-up sheets, whose stiffness, dragging and lines of force are simple formulas."""
import numpy as np
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.markers.touches.presses import Presses
from tactile_perception.markers.touches.touch import TouchEstimate
from tactile_perception.markers.view.marker_field import MarkerField
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.markers.wrench.membrane import SheetWrench
from tactile_perception.markers.wrench.regression import WrenchMap, fit_wrench_map

SENSOR = MARKER_SENSORS['areal_single']
REST = SENSOR.grid()
HALF = np.array(SENSOR.size) / 2


class ByDepth:
    """Mechanics that are wrong by a smooth factor."""

    def __call__(self, place, depth, radius=float('nan')):
        return np.array([0.2 * place[0] / HALF[0], 0.2 * place[1] / HALF[1], 1, 0, 0, 0]) * -depth * stiffness(place, depth) / 80

    def numbers(self):
        return {}


def stiffness(place, depth):
    """N/m: more beside the clamp, and where it is stretched."""
    return 80 * (1 + depth / 0.01) / np.prod(1 - (place[:2] / HALF)**4)


def press(x, y, depth, drag=(0.0, 0.0), twist=0.0, seed=0):
    """The field about a tip that pushes markers away and drags them along, m, and the wrench that does it: it stands uphill of the tip."""
    place = np.array([x, y, -depth])
    off = REST - place[:2]
    bell = np.exp(-np.sum(off**2, axis=1) / 1e-4)[:, None]
    shift = bell * (20 * depth * off + drag) + np.random.default_rng(seed).normal(0, 2e-6, REST.shape)
    normal = -depth * stiffness(place, depth)
    share = place[:2] / HALF
    force = np.append(0.25 * share * normal + 60 * np.array(drag), normal)
    own = normal * np.array([-8e-4 * share[1], 8e-4 * share[0], twist])
    nan = np.full(len(REST), np.nan)
    field = MarkerField(REST, shift, nan, np.tile([0, 0, -0.06], (len(REST), 1)), nan, REST * np.nan, REST * np.nan, nan)
    return field, np.concatenate([force, np.cross(place, force) + own]), place


def recording(drags=True, count=60, seed=3, reach=0.6):
    rng = np.random.default_rng(seed)
    made = [press(*(rng.uniform(-reach, reach, 2) * HALF), rng.uniform(0.001, 0.01), drag=rng.normal(0, 1e-3, 2) * drags, seed=k)
            for k in range(count)]
    fields, wrenches, places = zip(*made)
    places, radius = np.array(places), np.full(count, np.nan)
    return Presses(fields, places, -places[:, 2], np.arange(count), np.array(wrenches), radius)


def touch(place):
    return TouchEstimate(np.array(place), -place[2], 1e-8 * np.eye(3), 1e-4)


def told_by(numbers, presses):
    told = WrenchMap(numbers)
    return np.array([told.wrench(field, touch(place)) for field, place in zip(presses.fields, presses.position)])


def errors(told, truth):
    return [np.median(np.linalg.norm((told - truth)[:, part], axis=1) / np.linalg.norm(truth[:, part], axis=1))
            for part in (slice(3), slice(3, 6))]


@pytest.fixture(scope='module')
def numbers():
    return fit_wrench_map(recording(), SENSOR)


def test_wrenches_of_other_presses_and_drags_are_told(numbers):
    others = recording(seed=9)
    force, moment = errors(told_by(numbers, others), others.wrench)
    assert force < 0.02 and moment < 0.02
    assert numbers['held_out_force'] < 0.03 and numbers['held_out_moment'] < 0.03 and all(numbers['told'])


def test_mechanics_carry_a_few_presses_to_other_places(monkeypatch):
    """Nine places in three rows and columns, as one would press first, of which symmetry leaves four."""
    made = [press(x, y, depth) for x in (-0.018, 0, 0.018) for y in (-0.011, 0, 0.011) for depth in (0.003, 0.006, 0.009)]
    fields, wrenches, places = zip(*made)
    few = Presses(fields, np.array(places), -np.array(places)[:, 2], np.arange(27), np.array(wrenches), np.full(27, np.nan))
    with_mechanics, without = fit_wrench_map(few, SENSOR, ByDepth()), fit_wrench_map(few, SENSOR)
    assert 'mechanics' in with_mechanics and 'mechanics' not in without
    monkeypatch.setattr(SheetWrench, 'from_numbers', lambda numbers: ByDepth())
    others = recording(drags=False, count=20)
    (force, moment), (force_without, _) = (errors(told_by(numbers, others), others.wrench) for numbers in (with_mechanics, without))
    assert force < 0.005 and moment < 0.005 and force_without > 0.02


def test_mechanics_that_tell_no_better_are_left_out(numbers):
    class Backwards(ByDepth):
        def __call__(self, place, depth, radius=float('nan')):
            return super().__call__(place, depth) * np.exp(np.sin(900 * place[0]) + np.cos(1100 * place[1]))
    assert 'mechanics' not in fit_wrench_map(recording(), SENSOR, Backwards())


def test_an_axis_that_was_not_excited_is_unknown():
    made = [press(0.0, y, depth) for y in np.linspace(-0.012, 0.012, 7) for depth in (0.003, 0.006, 0.009)]
    fields, wrenches, places = zip(*made)
    row = Presses(fields, np.array(places), -np.array(places)[:, 2], np.arange(21), np.array(wrenches), np.full(21, np.nan))
    told = WrenchMap(fit_wrench_map(row, SENSOR)).wrench(fields[4], touch(places[4]))
    assert np.isnan(told).tolist() == [True, False, False, False, True, True]
    assert told[[1, 2, 3]] == pytest.approx(wrenches[4][[1, 2, 3]], rel=0.03)


def test_markers_that_are_not_seen_are_left_out(numbers):
    field, wrench, place = press(0.006, 0.004, 0.005, drag=(8e-4, 0.0))
    field.shift[::7] = np.nan
    assert WrenchMap(numbers).wrench(field, touch(place))[:3] == pytest.approx(wrench[:3], rel=0.1, abs=0.01)
    field.shift[:] = np.nan
    assert np.isnan(WrenchMap(numbers).wrench(field, touch(place))).all()


def test_without_depth_there_is_no_wrench(numbers):
    field, _, place = press(0.006, 0.004, 0.005)
    assert np.isnan(WrenchMap(numbers).wrench(field, touch(place * [1, 1, 0]))).all()


def test_a_dome_is_told_too():
    dome, rng = MARKER_SENSORS['air_cushion'], np.random.default_rng(4)
    rest, made = dome.grid(), []
    for _ in range(40):
        place, depth, drag = rng.uniform(-0.06, 0.06, 2), rng.uniform(0.005, 0.03), rng.normal(0, 2e-3, 2)
        bell = np.exp(-np.sum((rest - place)**2, axis=1) / 2e-3)[:, None]
        normal = -600 * depth * (1 + depth / 0.02)
        force = np.append(-2 * place * normal + 900 * drag, normal)
        tip, nan = np.append(place, 0.12 - place @ place / 0.3 - depth), np.full(len(rest), np.nan)
        field = MarkerField(rest, bell * (5 * depth * (rest - place) + drag), nan, np.zeros((len(rest), 3)), nan, rest, rest, nan)
        made.append((field, tip, depth, np.concatenate([force, np.cross(tip, force)])))
    fields, places, depths, wrenches = (list(column) for column in zip(*made))
    presses = Presses(tuple(fields), np.array(places), np.array(depths), np.arange(40), np.array(wrenches), np.full(40, np.nan))
    numbers = fit_wrench_map(presses.select(np.arange(40) < 30), dome)
    told = np.array([WrenchMap(numbers).wrench(field, TouchEstimate(place, depth, np.eye(3), 1e-4))
                     for field, place, depth, _ in made[30:]])
    told[:, 5] = np.nan_to_num(told[:, 5])
    force, moment = errors(told, np.array(wrenches[30:]))
    assert force < 0.03 and moment < 0.03


def test_what_cannot_be_fitted_or_read_is_refused(numbers):
    with pytest.raises(BadCalibration, match='too few'):
        fit_wrench_map(recording(count=5), SENSOR)
    blind = recording(count=8)
    for field in blind.fields:
        field.shift[:] = np.nan
    with pytest.raises(BadCalibration, match='markers'):
        fit_wrench_map(blind, SENSOR)
    with pytest.raises(BadCalibration, match='calibrate anew'):
        WrenchMap({key: value for key, value in numbers.items() if key != 'scale'})
    with pytest.raises(BadCalibration, match='agree'):
        WrenchMap(numbers | {'told': [True]})

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The wrench is told of made-up sheets, whose stiffness, dragging and lines of force are simple formulas."""
from dataclasses import replace

import numpy as np
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.markers.touches.presses import Presses
from tactile_perception.markers.touches.touch import TouchEstimate
from tactile_perception.markers.view.marker_field import MarkerField
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.markers.wrench.regression import WrenchMap, fit_wrench_map

SENSOR = MARKER_SENSORS['areal_single']
REST = SENSOR.grid()
HALF = np.array(SENSOR.size) / 2


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


class Mechanics:
    """A method that tells every wrench over 80 N/m, with small errors."""

    def __init__(self, presses):
        self._told = {id(field): (place, wrench / 80) for field, place, wrench in zip(presses.fields, presses.position, presses.wrench)}

    def estimate(self, field):
        place, wrench = self._told[id(field)]
        return [replace(touch(place), wrench=wrench * (1 + 0.01 * np.sin(1e5 * place[0])))]


def test_a_method_that_tells_wrenches_is_given_its_stiffness():
    known = recording(count=20)
    fitted = fit_wrench_map(known, SENSOR, Mechanics(known))
    assert fitted['stiffness'] == pytest.approx(80, rel=0.01) and fitted['told'] == [1] * 6 and fitted['held_out_force'] < 0.02
    told = WrenchMap(fitted).wrench(known.fields[3], Mechanics(known).estimate(known.fields[3])[0])
    assert told == pytest.approx(known.wrench[3], rel=0.03)


def test_a_touch_without_a_wrench_is_told_by_the_map():
    known = recording()
    fitted = fit_wrench_map(known, SENSOR, Mechanics(known))
    force, moment = errors(told_by(fitted, known), known.wrench)
    assert force < 0.02 and moment < 0.02


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


def test_a_model_tells_the_wrench_of_touches_that_have_none(numbers):
    presses, unit = recording(count=1), np.array([0.1, 0.0, -1.0, 0.0, 2e-3, 0.0])
    field, found = presses.fields[0], touch(presses.position[0])

    class Model:
        said = [replace(found, wrench=unit)]

        def estimate(self, _field):
            return self.said
    told = WrenchMap(numbers | {'stiffness': 3.0}, Model())
    assert told.wrench(field, found) == pytest.approx(3 * unit)
    assert told.wrench(field, replace(found, wrench=2 * unit)) == pytest.approx(6 * unit)
    Model.said = []
    assert told.wrench(field, found) == pytest.approx(WrenchMap(numbers).wrench(field, found), nan_ok=True)


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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What calibrate makes of presses whose wrench was recorded."""
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_perception.markers.methods import TOUCH_METHODS
from tactile_perception.markers.touches.presses import Presses
from tactile_perception.markers.touches.touch import TouchEstimate
from tactile_perception.markers.view.marker_field import MarkerField
from tactile_perception.markers.view.sensor import MARKER_SENSORS
from tactile_perception.tools.calibrate import markers as calibrate_markers
from tactile_perception.tools.calibrate.markers import fit_wrench

SENSOR = MARKER_SENSORS['areal_single']
REST = SENSOR.grid()


class Beside:
    """A method that tells each touch a millimetre to the right of where the field has it, or none where the field is blind."""

    @classmethod
    def from_fitted(cls, fitted, sensor):
        return cls()

    def estimate(self, field):
        x, y, depth = field.sigma[:3]
        return [TouchEstimate(np.array([x + 1e-3, y, -depth]), depth, 1e-8 * np.eye(3), 1e-4)] if x < 0.009 else []


def recorded(places, wrench=True):
    """Presses at places (N, 3), x, y and depth, m, straight down or along as they follow each other; sigma tells the method the truth."""
    fields, wrenches = [], []
    for x, y, depth in places:
        bell = np.exp(-np.sum((REST - [x, y])**2, axis=1) / 1e-4)[:, None]
        told = np.full(len(REST), 1e-5)
        told[:3] = x, y, depth
        nan = np.full(len(REST), np.nan)
        fields.append(MarkerField(REST, 20 * depth * bell * (REST - [x, y]), nan, np.zeros((len(REST), 3)), told, REST, REST, nan))
        force = np.array([0.0, 0.0, -100 * depth])
        wrenches.append([*force, *np.cross([x, y, -depth], force)] if wrench else [np.nan] * 6)
    places = np.array(places)
    return Presses(tuple(fields), places * [1, 1, -1], places[:, 2], np.arange(len(places)), np.array(wrenches),
                   np.full(len(places), np.nan))


STRAIGHT = [(x, y, depth) for x in (-0.012, 0.0, 0.012) for y in (-0.008, 0.008) for depth in (0.002, 0.004)]
DRAG = [(0.0, 0.0, 0.004), (0.002, 0.0, 0.004), (0.004, 0.0, 0.004), (0.006, 0.0, 0.004), (0.010, 0.0, 0.004)]


@pytest.fixture
def reader():
    return SimpleNamespace(sensor=SENSOR, left_out=[])


@pytest.fixture
def fitted_to(monkeypatch):
    """What the map was fitted to, once it was."""
    seen = {}

    def fit(presses, sensor, method):
        seen.update(presses=presses, method=method)
        return {}
    monkeypatch.setattr(calibrate_markers, 'fit_wrench_map', fit)
    monkeypatch.setitem(TOUCH_METHODS, 'beside', Beside)
    return seen


def test_without_a_recorded_wrench_there_is_no_map(reader):
    assert fit_wrench(recorded(STRAIGHT, wrench=False), reader, {}) is None
    assert reader.left_out == ['wrench: no ground_truth/wrench was recorded with the presses']


def test_too_few_presses_are_noted(reader):
    assert fit_wrench(recorded(STRAIGHT[:3]), reader, {}) is None
    assert 'too few' in reader.left_out[0]


def test_the_force_of_a_press_is_found_again(reader):
    numbers = fit_wrench(recorded(STRAIGHT), reader, {})
    assert numbers['held_out_force'] < 0.02 and reader.left_out == []


def test_presses_are_taken_where_they_were_and_drags_where_the_method_tells_them(reader, fitted_to):
    known = recorded(STRAIGHT + DRAG)
    fit_wrench(known, reader, {'beside': {}}, 'beside')
    moved = fitted_to['presses'].position[:, 0] - known.position[:, 0]
    assert moved == pytest.approx([0] * len(STRAIGHT) + [0, 1e-3, 1e-3, 1e-3, 0])  # of the last the method knows nothing
    fit_wrench(known, reader, {'beside': {}})
    assert fitted_to['presses'].position == pytest.approx(known.position)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What calibrate makes of presses whose wrench was recorded."""
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_perception.press.methods import TOUCH_METHODS
from tactile_perception.press.presses import Presses
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.sensor import MARKER_SENSORS
from tactile_perception.press.tools import fit_wrench


class Pushes:
    """A model of a skin of 50 N/m that finds every press."""

    @classmethod
    def from_fitted(cls, fitted, sensor):
        return cls()

    def estimate(self, field):
        return [TouchEstimate(np.zeros(3), 1e-3, 1e-8 * np.eye(3), 1e-4, wrench=field.wrench / 50)]


def recorded(count, wrench=True):
    depth = np.linspace(1e-3, 5e-3, count)
    wrenches = depth[:, None] * [10.0, 0.0, -100.0, 0.0, 0.2, 0.0]
    return Presses(tuple(SimpleNamespace(wrench=row) for row in wrenches), np.zeros((count, 3)), depth, np.arange(count),
                   wrenches if wrench else np.full((count, 6), np.nan), np.full(count, np.nan))


@pytest.fixture
def reader(monkeypatch):
    monkeypatch.setitem(TOUCH_METHODS, 'model', Pushes)
    return SimpleNamespace(sensor=MARKER_SENSORS['areal_single'], left_out=[])


def test_without_a_recorded_wrench_or_a_model_there_is_no_stiffness(reader):
    assert fit_wrench(recorded(12, wrench=False), reader, {'model': {}}) is None
    assert fit_wrench(recorded(12), reader, {'paper': {}}) is None
    assert reader.left_out == ['wrench: no ground_truth/wrench was recorded with the presses', 'wrench: only the method model gives it']


def test_too_few_presses_are_noted(reader):
    assert fit_wrench(recorded(3), reader, {'model': {}}) is None
    assert 'too few' in reader.left_out[0]


def test_the_stiffness_is_found(reader):
    stiffness, errors = fit_wrench(recorded(12), reader, {'model': {}})
    assert stiffness == pytest.approx(50) and errors == pytest.approx({'force': 0, 'moment': 0}, abs=1e-9) and reader.left_out == []

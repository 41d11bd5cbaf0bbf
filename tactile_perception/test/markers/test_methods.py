# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_scenes import DOME, FEW, dome_field, dome_presses
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.markers.methods import TOUCH_METHODS, RegressionTouch, make_method, sheet_model
from tactile_perception.markers.regression import dome as regression_dome
from tactile_perception.markers.regression.dome import DomeRegression
from tactile_perception.markers.regression.sheet import SheetRegression
from tactile_perception.markers.view.sensor import MARKER_SENSORS

SHEET = MARKER_SENSORS['areal_single']


def test_a_dome_is_fitted_as_a_dome(monkeypatch):
    monkeypatch.setattr(regression_dome, 'RIDGES', (1e-6,))  # not the best of several: sooner
    method = RegressionTouch.from_fitted(RegressionTouch.fit(dome_presses(FEW, (0.012, 0.025)), DOME), DOME)
    assert isinstance(method, DomeRegression)
    touch, = method.estimate(dome_field([((0.02, -0.01), 0.02)]))
    assert np.hypot(*(touch.position[:2] - [0.02, -0.01])) < 2e-3 and touch.depth == pytest.approx(0.02, abs=1e-3)


def test_a_sheet_is_fitted_as_a_sheet(bell_field, bell_presses, membrane):
    method = RegressionTouch.from_fitted(RegressionTouch.fit(bell_presses(shape=membrane), SHEET), SHEET)
    assert isinstance(method, SheetRegression)
    touch, = method.estimate(bell_field((7e-3, 3e-3), 4e-3, membrane))
    assert np.hypot(*(touch.position[:2] - [7e-3, 3e-3])) < 0.3e-3 and touch.depth == pytest.approx(4e-3, abs=0.2e-3)


def test_numbers_of_the_other_kind_are_refused(bell_presses):
    with pytest.raises(BadCalibration, match='calibrate anew'):
        RegressionTouch.from_fitted(RegressionTouch.fit(bell_presses(), SHEET), DOME)


def test_an_unknown_method_is_refused():
    with pytest.raises(BadArgument, match='unknown touch method'):
        make_method('magic', {}, MARKER_SENSORS['areal_single'])


def test_a_sheet_has_a_model_beside_the_regression(monkeypatch):
    class Model:
        from_fitted = staticmethod(lambda fitted, sensor: (fitted, sensor))
    monkeypatch.setitem(TOUCH_METHODS, 'model', Model)
    methods = {'regression': {}, 'model': {'a': 1}}
    assert sheet_model('regression', methods, SHEET) == ({'a': 1}, SHEET)
    assert sheet_model('model', methods, SHEET) is None and sheet_model('paper', methods, SHEET) is None
    assert sheet_model('regression', methods, DOME) is None and sheet_model('regression', {'regression': {}}, SHEET) is None

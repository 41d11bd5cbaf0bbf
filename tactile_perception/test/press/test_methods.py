# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.press.methods import make_method, methods_for
from tactile_perception.press.published import PaperTouch
from tactile_perception.press.sensor import MARKER_SENSORS

SHEET, DOME = MARKER_SENSORS['areal_single'], MARKER_SENSORS['air_cushion']


def test_each_kind_of_surface_has_its_methods():
    assert list(methods_for(SHEET)) == ['paper', 'model'] and list(methods_for(DOME)) == ['paper_cushion', 'model']


def test_a_method_is_made_of_its_numbers(bell_presses):
    fitted = PaperTouch.fit(bell_presses(), SHEET)
    assert isinstance(make_method('paper', fitted, SHEET), PaperTouch)
    with pytest.raises(BadCalibration, match='calibrate anew'):
        make_method('paper_cushion', fitted, DOME)


def test_an_unknown_method_is_refused():
    with pytest.raises(BadArgument, match='no touch method'):
        make_method('magic', {}, SHEET)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.press.sensor import MARKER_SENSORS, MarkerSensor, dome_cap, first_touch_height


@pytest.mark.parametrize('wrong', [{}, {'size': (0.06, 0.04), 'rim_radius': 0.1, 'height': 0.1}, {'rim_radius': 0.1}])
def test_neither_sheet_nor_dome_is_refused(wrong):
    with pytest.raises(BadArgument, match='either size'):
        MarkerSensor(9, 13, (4e-3, 4e-3), **wrong)


DOME, SHEET = MARKER_SENSORS['air_cushion'], MARKER_SENSORS['areal_single']


def test_a_tip_touches_a_slope_before_its_lowest_point_does():
    height = first_touch_height([[0, 0], [0.05, 0.0]], 0.02, DOME)
    assert height[0] == pytest.approx(0.12) and height[1] > dome_cap(DOME).heights(np.array([[0.05, 0]]))[0]
    assert np.isnan(first_touch_height([0.3, 0.0], 0.02, DOME)[0])
    assert first_touch_height([0.01, 0.0], 0.02, SHEET) == [0.0]

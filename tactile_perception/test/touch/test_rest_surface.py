# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.touch.rest_surface import dome_cap, first_touch_height, rest_points
from tactile_perception.touch.sensor import MARKER_SENSORS

DOME, SHEET = MARKER_SENSORS['air_cushion'], MARKER_SENSORS['areal_single']


def test_markers_of_a_dome_stand_on_its_sphere():
    eye = np.array([[0.0, 0.0, -0.045]])
    points = np.array([[0.0, 0.0, 0.12], [0.05, -0.02, 0.0]])
    points[1, 2] = dome_cap(DOME).heights(points[1:, :2])[0]
    seen = eye + (points - eye) * ((0.12 + 0.045) / (points[:, 2:] + 0.045))
    assert rest_points(seen[:, :2], np.repeat(eye, 2, 0), DOME) == pytest.approx(points, abs=1e-12)
    assert dome_cap(DOME).rim_radius == pytest.approx(0.15)


def test_markers_of_a_sheet_stand_where_they_appear():
    points = rest_points(np.array([[0.01, 0.02], [np.nan, 0]]), np.zeros((2, 3)), SHEET)
    assert points[0] == pytest.approx([0.01, 0.02, 0.0]) and np.isnan(points[1, 0])


def test_a_tip_touches_a_slope_before_its_lowest_point_does():
    height = first_touch_height([[0, 0], [0.05, 0.0]], 0.02, DOME)
    assert height[0] == pytest.approx(0.12) and height[1] > dome_cap(DOME).heights(np.array([[0.05, 0]]))[0]
    assert np.isnan(first_touch_height([0.3, 0.0], 0.02, DOME)[0])
    assert first_touch_height([0.01, 0.0], 0.02, SHEET) == [0.0]

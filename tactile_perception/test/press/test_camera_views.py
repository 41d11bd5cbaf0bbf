# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_perception.common.camera import CameraModel
from tactile_perception.press.camera_views import stitched_view, view_maker
from tactile_perception.press.sensor import MARKER_SENSORS

MATRIX, DISTORTION = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), np.zeros(5)


def side(x):
    return SideView((640, 480), MATRIX, DISTORTION, np.array([[1.0, 0, -x], [0, 1, 0], [0, 0, 0.05]]), np.array([x, 0, -0.05]))


STITCHING = Stitching(side(-0.02), side(0.02), (800, 500), 1e4, np.array([400.0, 250.0]), 400.0, (500.0, 140.0))


def test_a_stitched_picture_is_a_plane_with_two_eyes():
    for view in (stitched_view(STITCHING), view_maker(MARKER_SENSORS['areal_dual'], None, STITCHING.to_dict())(None)):
        seen, eyes = view.back_project(np.array([(300.0, 250.0), (500.0, 350.0)]))
        assert seen == pytest.approx(np.array([(-0.01, 0, 1e-8), (0.01, 0.01, 1e-8)]), abs=1e-12)
        assert eyes == pytest.approx(np.array([(-0.02, 0, -0.05), (0.02, 0, -0.05)]))


def test_a_sheet_s_camera_stands_where_its_untouched_markers_say():
    sensor, camera = MARKER_SENSORS['areal_single'], CameraModel(MATRIX, DISTORTION, translation=np.array([0.001, -0.002, 0.06]))
    rest = camera.project(np.column_stack([sensor.grid(), np.zeros(117)]))
    view = view_maker(sensor, (MATRIX, DISTORTION), None)(rest)
    seen, eyes = view.back_project(rest)
    assert seen[:, :2] == pytest.approx(sensor.grid(), abs=1e-6) and eyes[0] == pytest.approx([-0.001, 0.002, -0.06], abs=1e-6)


def test_a_dome_s_camera_stands_where_the_parameters_say():
    pose = np.eye(3), np.array([0.0, 0.0, 0.045])
    view = view_maker(MARKER_SENSORS['air_cushion'], (MATRIX, DISTORTION), None, pose)(None)
    seen, eyes = view.back_project(np.array([(320.0, 240.0), (420.0, 240.0)]))
    assert eyes[0] == pytest.approx([0, 0, -0.045])
    assert seen[:, :2] == pytest.approx(np.array([(0, 0), (0.2 * 0.165, 0)]))


def test_without_a_calibrated_camera_there_is_no_view():
    assert view_maker(MARKER_SENSORS['areal_single'], None, None) is None
    with pytest.raises(BadArgument):
        view_maker(MARKER_SENSORS['areal_dual'], None, {'size': [1]})

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.camera import CameraModel
from tactile_perception.dots.dots import DotTracks
from tactile_perception.pipeline.sheet_places import SheetPlaces
from tactile_perception.touch.sensor import MARKER_SENSORS
from tactile_perception.touch.view import camera_view

SENSOR = MARKER_SENSORS['areal_single']
CAMERA = CameraModel(np.array([[560.0, 0, 320], [0, 560, 240], [0, 0, 1]]), translation=np.array([0.0, 0.0, 0.062]))


def tracks(xyz, rest_uv):
    uv = CAMERA.project(xyz)
    count = len(uv)
    return DotTracks(9, 13, np.arange(count), uv, np.full(count, 300.0), np.full(count, np.nan), uv - rest_uv)


def test_the_camera_s_place_comes_from_the_untouched_markers_and_theirs_from_the_picture():
    rest = np.column_stack([SENSOR.grid(), np.zeros(117)])
    rest_uv = CAMERA.project(rest)
    places = SheetPlaces(SENSOR, lambda uv: camera_view(CAMERA.matrix, CAMERA.distortion, uv, SENSOR))
    assert places.locate(None, tracks(rest, rest_uv)) == pytest.approx(rest, abs=1e-6)
    down = rest.copy()
    down[:, 2] = -4e-3 * np.exp(-0.5 * ((rest[:, :2] - [0.004, 0.002])**2).sum(1) / 0.008**2)
    assert np.sqrt(np.mean((places.locate(None, tracks(down, rest_uv)) - down)[:, 2]**2)) < 0.15e-3
    places.renew()
    assert places.locate(None, tracks(rest, rest_uv)) == pytest.approx(rest, abs=1e-6)

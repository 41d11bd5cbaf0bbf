# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from tactile_driver.simulation.sensors.touchpad import touchpad_camera

PLACES = np.array([[0.0, 0, 0.013], [0.01, 0.004, 0.008], [-0.012, 0.013, 0.004], [0.004, -0.015, 0.006]])


@pytest.fixture
def camera():
    return touchpad_camera()


def test_projection_agrees_with_opencv(camera):
    uv, _ = cv2.projectPoints(PLACES, cv2.Rodrigues(camera.rotation)[0], camera.translation, camera.matrix, camera.distortion)
    np.testing.assert_allclose(camera.project(PLACES), uv[:, 0], atol=1e-9)


def test_rays_undo_the_projection(camera):
    rays = camera.rays(camera.project(PLACES))
    arms = PLACES - camera.centre
    np.testing.assert_allclose(rays, arms / np.linalg.norm(arms, axis=1, keepdims=True), atol=1e-6)


def test_camera_looks_out_with_u_along_x_and_v_along_y(camera):
    middle, right, below = camera.project(np.array([[0, 0, 0.013], [0.005, 0, 0.013], [0, 0.005, 0.013]]))
    assert right[0] - middle[0] > 60 and abs(right[1] - middle[1]) < 2
    assert below[1] - middle[1] > 60 and abs(below[0] - middle[0]) < 2
    assert camera.centre[2] == pytest.approx(-0.040, abs=2e-4)

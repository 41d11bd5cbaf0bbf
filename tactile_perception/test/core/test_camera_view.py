# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from tactile_driver.lens import farthest_square
from tactile_perception._core import back_project, camera_rays

MATRIX = np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]])
LENSES = [np.zeros(5), np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0]), np.array([0.08, 0.0, -3e-4, 2e-4, 0.01]),
          np.array([-0.3, 0.12, 0, 0, -0.02])]
ROTATION = cv2.Rodrigues(np.array([0.1, -0.2, 0.3]))[0]
CENTRE, PLANE_Z = np.array([0.003, -0.002, -0.06]), 0.004


def seen(uv, lens, rotation=ROTATION):
    return back_project(uv, matrix=MATRIX, distortion=lens, rotation=rotation, centre=CENTRE, farthest=farthest_square(lens),
                        plane_z=PLANE_Z)


def image(places, lens, rotation=ROTATION):
    """(N, 2) px: OpenCV's projection of places (N, 2) in the plane."""
    points = np.column_stack([places, np.full(len(places), PLANE_Z)])
    return cv2.projectPoints(points, cv2.Rodrigues(rotation)[0], -rotation @ CENTRE, MATRIX, lens)[0].reshape(-1, 2)


@pytest.mark.parametrize('lens', LENSES)
def test_places_are_found_from_their_pixels(lens):
    places = np.random.default_rng(1).uniform(-0.025, 0.025, (200, 2))
    assert seen(image(places, lens), lens)[:, :2] == pytest.approx(places, abs=1e-12)


@pytest.mark.parametrize('lens', LENSES)
def test_the_area_of_a_pixel_is_that_between_its_neighbours(lens):
    uv = np.random.default_rng(2).uniform([0, 0], [640, 480], (50, 2))
    right, down = (seen(uv + step, lens)[:, :2] - seen(uv - step, lens)[:, :2] for step in ([0.5, 0], [0, 0.5]))
    assert seen(uv, lens)[:, 2] == pytest.approx(np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0]), rel=1e-4)


@pytest.mark.parametrize('lens', LENSES)
def test_rays_go_through_what_their_pixels_show(lens):
    points = np.random.default_rng(3).uniform([-0.025, -0.025, -0.01], [0.025, 0.025, 0.01], (200, 3))
    uv = cv2.projectPoints(points, cv2.Rodrigues(ROTATION)[0], -ROTATION @ CENTRE, MATRIX, lens)[0].reshape(-1, 2)
    away = points - CENTRE
    rays = camera_rays(uv, matrix=MATRIX, distortion=lens, rotation=ROTATION, farthest=farthest_square(lens))
    assert rays == pytest.approx(away / np.linalg.norm(away, axis=1, keepdims=True), abs=1e-11)


def test_what_the_lens_does_not_image_and_what_is_not_a_place_are_unknown():
    fold = LENSES[3] * [1, 0, 0, 0, 0]
    outside = np.array([[320 + 601 * np.sqrt(farthest_square(fold)), 240], [np.nan, 3.0], [np.inf, 3.0], [1e30, 1e30]])
    assert np.isnan(seen(outside, fold)).all()
    assert np.isnan(camera_rays(outside, matrix=MATRIX, distortion=fold, rotation=ROTATION, farthest=farthest_square(fold))).all()
    assert np.isnan(seen(outside[1:], LENSES[0], np.eye(3))).all()
    horizon = cv2.Rodrigues(np.array([np.pi / 2, 0.0, 0.0]))[0]  # the plane is seen edge on
    assert np.isnan(seen(np.array([[320.0, 240.0]]), LENSES[0], horizon)).all()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from tactile_driver.lens import undistorted

MATRIX = np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]])
BARREL = np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0])


def appears(plane, distortion):
    still = np.zeros(3)
    return cv2.projectPoints(np.column_stack([plane, np.ones(len(plane))]), still, still, MATRIX, distortion)[0].reshape(-1, 2)


@pytest.mark.parametrize('distortion', [np.zeros(5), BARREL])
def test_what_comes_out_appears_where_it_came_from(distortion):
    uv = np.random.default_rng(0).uniform([0, 0], [640, 480], (50, 2))
    assert np.abs(appears(undistorted(uv, MATRIX, distortion), distortion) - uv).max() < 1e-3


def test_no_place_gives_none():
    assert undistorted(np.zeros((0, 2)), MATRIX, BARREL).shape == (0, 2)


def test_what_no_ray_can_reach_is_not_known():
    """With k1 alone the radius r (1 + k1 r^2) is largest at r^2 = -1 / (3 k1)."""
    lens = np.array([-0.1, 0, 0, 0, 0])
    farthest = 2 / 3 * np.sqrt(1 / 0.3)
    at = np.array([[320 + 600 * farthest * share, 240] for share in (0.9, 1.01)])
    known = np.isfinite(undistorted(at, MATRIX, lens)).all(axis=1)
    assert known.tolist() == [True, False]
    nowhere = np.array([[np.nan, 0], [np.inf, 0], [1e30, 1e30]])
    assert np.isnan(undistorted(nowhere, MATRIX, lens)).all() and np.isnan(undistorted(nowhere, MATRIX, BARREL)).all()
    assert np.isfinite(undistorted(nowhere[2:], MATRIX, np.zeros(5))).all()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Lines and notches against known extents and OpenCV."""
import cv2
import numpy as np
import pytest
from tactile_perception import _core


def notch_in_opencv(corners):
    """Largest convexity defect, by OpenCV in whole numbers."""
    points = np.rint(corners * 1024).astype(np.int32).reshape(-1, 1, 2)
    defects = cv2.convexityDefects(points, np.sort(cv2.convexHull(points, returnPoints=False), axis=0))
    return 0.0 if defects is None else defects[..., 3].max() / 256 / 1024


@pytest.mark.parametrize('turn', [1, -1])
@pytest.mark.parametrize('seed', range(20))
def test_notches_of_star_shaped_polygons_are_those_of_opencv(seed, turn):
    rng = np.random.default_rng(seed)
    angle, radius = np.sort(rng.uniform(0, 2 * np.pi, 5 + 4 * seed)), rng.uniform(2, 6, 5 + 4 * seed)
    corners = np.roll((radius * [np.cos(angle), np.sin(angle)]).T[::turn], seed, axis=0)
    assert _core.deepest_notch(np.ascontiguousarray(corners)) == pytest.approx(notch_in_opencv(corners), abs=4e-3)


def test_a_convex_polygon_has_no_notch():
    angle = np.arange(12) * np.pi / 6
    assert _core.deepest_notch(np.stack([np.cos(angle), np.sin(angle)], axis=1)) < 1e-12
    assert _core.deepest_notch(np.array([[0.0, 0], [2, 0], [0, 2]])) == 0
    assert _core.deepest_notch(np.ones((7, 2))) == 0


@pytest.mark.parametrize('width', [0.0, 0.9e-3, 1.1e-3, 0.5])
def test_points_are_on_a_line_by_their_second_extent(width):
    rng = np.random.default_rng(5)
    cloud = rng.normal(size=(50, 3))
    extents = np.linalg.qr(cloud - cloud.mean(axis=0))[0] * [1.0, width, 0.0]
    points = extents @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
    assert _core.lie_on_a_line(points, thinnest=1e-3) == (width < 1e-3)

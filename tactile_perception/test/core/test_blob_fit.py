# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel fit_blobs (src/dots/detect/blob_fit.cpp) on discs whose places and sizes are known."""
import cv2
import numpy as np
import pytest
from tactile_perception import _core
from tactile_perception.dots.detect.blob_moments import find_regions, fit_blobs


FINE = 8


def discs(places, diameter, shape, noise):
    """uint8 (H, W): bright discs at places (N, 2) px, drawn finely, blurred and seen with noise."""
    fine = np.zeros((FINE * shape[0], FINE * shape[1]), np.float32)
    for place in places:
        centre = np.round(((place + 0.5) * FINE - 0.5) * 16).astype(int).tolist()
        cv2.circle(fine, centre, round(diameter / 2 * FINE * 16), 1.0, -1, cv2.LINE_8, 4)
    seen = cv2.GaussianBlur(cv2.resize(fine, shape[::-1], interpolation=cv2.INTER_AREA), (0, 0), 1.0)
    return np.clip(np.rint(30 + 150 * seen + np.random.default_rng(0).normal(0, noise, shape)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('step', [1, 2])
@pytest.mark.parametrize('noise', [0.5, 2.0])
def test_discs_are_found_where_they_are_as_large_as_they_are(step, noise):
    row, column = np.mgrid[:6, :8]
    places = np.stack([30.3 + 34 * column, 28.6 + 31 * row], axis=-1).reshape(-1, 2) + np.random.default_rng(1).uniform(-0.5, 0.5, (48, 2))
    image = discs(places, 15.0, (220, 300), noise)
    small = cv2.resize(image, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
    found = fit_blobs(image, small, step, find_regions(cv2.threshold(small, 105, 255, cv2.THRESH_BINARY)[1]))
    off = found.uv[np.hypot(*(found.uv[:, None] - places).transpose(2, 0, 1)).argmin(axis=0)] - places
    assert len(found.uv) == 48 and np.abs(off).max() < 0.03 + 0.04 * noise
    assert 0.5 < np.sqrt((off**2).mean() / (found.sigma**2).mean()) < 2
    assert found.area == pytest.approx(np.pi / 4 * 15.0**2, rel=0.05) and found.blur == pytest.approx(1.0, abs=0.3)


def test_without_regions_there_is_no_blur():
    image = np.zeros((20, 30), np.uint8)
    found, blur = _core.fit_blobs(image, image, np.zeros((20, 30), np.uint16), np.zeros((0, 4), np.int32), np.zeros((0, 2)),
                                  np.zeros(0, np.uint16), step=1)
    assert found.shape == (0, 6) and np.isnan(blur)


def test_a_region_at_the_border_of_the_small_image_is_refused():
    image = np.zeros((20, 30), np.uint8)
    for box in ((0, 5, 4, 4), (5, 5, 25, 4), (5, 5, 4, 15), (5, 5, 0, 4)):
        with pytest.raises(ValueError, match='box'):
            _core.fit_blobs(image, image, np.zeros((20, 30), np.uint16), np.array([box], np.int32), np.zeros((1, 2)),
                            np.ones(1, np.uint16), step=1)

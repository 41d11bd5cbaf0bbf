# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel fit_blobs (src/dots/detect/blob_fit.cpp) against a reference in NumPy."""
import blob_reference
import cv2
import numpy as np
import pytest
from tactile_perception import _core
from tactile_perception.dots.detect.blob_moments import find_regions, fit_blobs


def ellipses(seed, shape, noise):
    """A noisy image with bright ellipses on sloping light, some of which touch."""
    rng = np.random.default_rng(seed)
    image = np.zeros(shape, np.uint8)
    for u in range(30, shape[1] - 20, 34):
        for v in range(25, shape[0] - 20, 31):
            at, axes = (rng.normal((u, v), 3)).astype(int).tolist(), rng.integers(6, 15, 2).tolist()
            cv2.ellipse(image, at, axes, float(rng.uniform(0, 180)), 0, 360, int(rng.integers(120, 220)), -1, cv2.LINE_AA)
    light = np.linspace(0.6, 1.0, shape[1]) * cv2.GaussianBlur(image, (0, 0), 1.1) + 20 + rng.normal(0, noise, shape)
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('shape', [(240, 320), (161, 243)])
@pytest.mark.parametrize('step', [1, 2])
@pytest.mark.parametrize('noise', [1.0, 3.0])
def test_moments_are_those_of_the_reference(shape, step, noise):
    image = ellipses(int(noise) + step, shape, noise)
    small = cv2.resize(image, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
    regions = find_regions(cv2.threshold(small, 60, 255, cv2.THRESH_BINARY)[1])
    found, expected = fit_blobs(image, small, step, regions), blob_reference.fit_blobs(image, small, step, regions)
    assert len(found.uv) == len(regions) > 10
    off = np.abs(found.uv - expected.uv).max(axis=1)
    assert np.quantile(off, 0.95) < 1e-5 and off.max() < 0.005  # a pixel on the border of a plateau may count in one and not in the other
    assert np.abs(found.area / expected.area - 1).max() < 1e-5
    assert np.quantile(np.abs(found.sigma / expected.sigma - 1), 0.95) < 1e-3
    assert np.array_equal(found.amplitude, expected.amplitude)
    assert np.abs(found.solidity / expected.solidity - 1).max() < 1e-5
    assert found.blur == pytest.approx(expected.blur, rel=1e-5)


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

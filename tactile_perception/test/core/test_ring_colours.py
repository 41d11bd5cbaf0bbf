# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel ring_colours (src/touchpad/water.cpp) against the same means taken one point at a time."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import ring_colours


def nine(image, column, row):
    """Sum (3,) of the 3 x 3 pixels around a place; black outside of the image."""
    padded = np.pad(image.astype(float), ((2, 2), (2, 2), (0, 0)))
    if not (-1 <= row <= image.shape[0] and -1 <= column <= image.shape[1]):
        return np.zeros(3)
    return padded[row + 1:row + 4, column + 1:column + 4].sum((0, 1))


def ring(image, place, radius):
    """ln(blue/red), ln(green/red), ln(red), number of points, patchiness of the ring around one place."""
    angle = np.arange(16) * np.pi / 8
    at = np.rint(place + radius * np.column_stack([np.cos(angle), np.sin(angle)])).astype(int)
    points = np.array([nine(image, column, row) for column, row in at])
    level = np.sort(points[:, 0])[12]
    keep = (points[:, 0] > 0.75 * level) & (points[:, 0] < 1.2 * level) & (points[:, 2] < 9 * 250)
    uneven = np.where(keep, points[:, 0] / np.maximum(points[:, 2], 1), 0.0)
    uneven = np.where(keep, uneven / max(uneven.sum() / max(keep.sum(), 1), 1e-6) - 1, 0.0)
    first = np.array([np.cos(angle), np.sin(angle)]) @ uneven
    patchy = (uneven**2).sum() / 16 - (first**2).sum() * 2 / 256
    mean = points[keep].mean(0) if keep.any() else np.zeros(3)
    if keep.sum() < 4 or mean.min() <= 4.5:
        return [np.nan] * 3 + [keep.sum(), patchy]
    return [np.log(mean[0] / mean[2]), np.log(mean[1] / mean[2]), np.log(mean[2] / 9), keep.sum(), patchy]


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 40), columns=st.integers(1, 40), dots=st.integers(0, 12),
       radius=st.floats(0, 12), darkest=st.integers(0, 200))
@settings(max_examples=60, deadline=None)
def test_colours_are_those_of_the_points_one_by_one(seed, rows, columns, dots, radius, darkest):
    rng = np.random.default_rng(seed)
    image = rng.integers(darkest, 256, (rows, columns, 3), dtype=np.uint8)
    uv = rng.uniform(-5, 45, (dots, 2))
    ratios, brightness, count, patchiness = ring_colours(image, uv, radius)
    expected = np.array([ring(image, place, radius) for place in uv]).reshape(-1, 5)
    assert count.dtype == np.int64
    np.testing.assert_array_equal(count, expected[:, 3])
    np.testing.assert_allclose(np.column_stack([ratios, brightness]), expected[:, :3], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(patchiness, expected[:, 4], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize('place', [(np.nan, 3.0), (np.inf, 3.0), (1e300, 3.0), (-1e9, -1e9)])
def test_a_place_that_is_none_or_outside_has_no_colour(place):
    ratios, brightness, count, patchiness = ring_colours(np.full((9, 9, 3), 100, np.uint8), np.array([place]), 3.0)
    assert np.isnan(ratios).all() and np.isnan(brightness).all() and count[0] == 0 and patchiness[0] == 0


def test_an_empty_image_has_no_colours():
    assert np.isnan(ring_colours(np.zeros((0, 0, 3), np.uint8), np.zeros((2, 2)), 3.0)[0]).all()

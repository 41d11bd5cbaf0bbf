# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel find_peaks (src/dots/detect/peaks.cpp) against plain sums over squares."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import find_peaks

ROUNDING = 1e-3  # of 255, of sums over up to 17 x 17 pixels in float32: pixels closer than this are level


def averaged(image, offsets, weights):
    """Sum of the image moved by each of the offsets (row, column), with weights; outside, the outermost pixels."""
    rows, columns = image.shape
    row, column = np.mgrid[:rows, :columns]
    return sum(weight * image[np.clip(row + r, 0, rows - 1), np.clip(column + c, 0, columns - 1)]
               for (r, c), weight in zip(offsets, weights))


def relief(image, step, smooth, box, sign):
    """How much pixels stand out, as the kernel should have it, by one sum over a square after the other."""
    rows, columns = image.shape[0] // step, image.shape[1] // step
    small = image[:rows * step, :columns * step].astype(float).reshape(rows, step, columns, step).mean((1, 3))
    side = range(-(smooth // 2), smooth // 2 + 1)
    offsets = [(r, c) for r in side for c in side]
    sigma = 0.3 * (smooth // 2) + 0.5
    weights = np.array([np.exp(-(r * r + c * c) / (2 * sigma**2)) for r, c in offsets])
    square = [(r, c) for r in range(-(box // 2), box // 2 + 1) for c in range(-(box // 2), box // 2 + 1)]
    return sign * (averaged(small, offsets, weights / weights.sum()) - averaged(small, square, np.full(len(square), 1 / box**2)))


def peaks(above, lowest, step, margin):
    """
    Places of the highest of nine pixels, tops of parabolas along both axes, one at a time.

    A pixel counts if it is higher than each neighbour, and than lowest, by more than margin.
    """
    found = []
    for r in range(1, above.shape[0] - 1):
        for c in range(1, above.shape[1] - 1):
            around = above[r - 1:r + 2, c - 1:c + 2]
            if above[r, c] <= max(lowest, np.delete(around.ravel(), 4).max()) + margin:
                continue
            top = [np.clip((b - a) / (2 * max(2 * m - a - b, 1.0)), -1, 1) for a, m, b in (around[1], around[:, 1])]
            found.append((np.array([c, r]) + top + 0.5) * step - 0.5)
    return np.array(found).reshape(-1, 2)


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(1, 40), columns=st.integers(1, 40), step=st.sampled_from([1, 2]),
       smooth=st.sampled_from([1, 3, 5, 11]), box=st.sampled_from([1, 3, 9, 17]), sign=st.sampled_from([-1, 1]))
@settings(max_examples=60, deadline=None)
def test_peaks_are_those_of_plain_sums(seed, rows, columns, step, smooth, box, sign):
    image = np.random.default_rng(seed).integers(0, 256, (rows, columns), dtype=np.uint8)
    found = find_peaks(image, step=step, smooth=smooth, box=box, sign=sign, lowest=5.0)
    above = relief(image, step, smooth, box, sign)
    for clear in peaks(above, 5.0, step, ROUNDING):
        assert np.abs(found - clear).max(axis=1).min() < 1e-3
    possible = peaks(above, 5.0, step, -ROUNDING)
    for place in found:
        assert np.abs(possible - place).max(axis=1).min() < 1e-3


@pytest.mark.parametrize('shape', [(0, 0), (0, 9), (9, 0), (1, 1), (2, 2), (5, 5)])
def test_images_too_small_for_a_peak_have_none(shape):
    assert find_peaks(np.zeros(shape, np.uint8), step=2, smooth=3, box=9, sign=1, lowest=1.0).shape == (0, 2)


def test_a_single_dot_is_found_in_its_pixel():
    image = np.full((40, 50), 180, np.uint8)
    image[20:25, 30:35] = 40
    for step in (1, 2):
        found = find_peaks(image, step=step, smooth=3, box=9, sign=-1, lowest=20.0)
        np.testing.assert_allclose(found, [[32, 22]], atol=0.6)

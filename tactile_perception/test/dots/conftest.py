# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of dots for the tests of this folder, sampled point by point: no formula of the detector's is in them."""
import cv2
import numpy as np
import pytest

FINE = 8


@pytest.fixture
def draw_dots():
    """Function that draws discs: draw_dots(uv (N, 2), diameters (N,), shape (rows, columns), blur px, ground, contrast) -> (rows,
    columns) float64."""

    def draw(uv, diameters, shape=(120, 160), blur=0.9, ground=180.0, contrast=-120.0):
        y, x = ((np.arange(length * FINE) + 0.5) / FINE - 0.5 for length in shape)
        inside = np.zeros((len(y), len(x)), np.float32)
        for (u, v), d in zip(uv, diameters):
            near = np.ix_(np.flatnonzero(np.abs(y - v) < d / 2 + 1), np.flatnonzero(np.abs(x - u) < d / 2 + 1))
            # a sample on the edge counts by how far the edge runs through it
            disc = np.clip((d / 2 - np.hypot(x[near[1][0]] - u, y[near[0]] - v)) * FINE + 0.5, 0, 1)
            inside[near] = np.maximum(inside[near], disc)
        blurred = cv2.GaussianBlur(inside, (0, 0), blur * FINE)
        return ground + contrast * cv2.resize(blurred, shape[::-1], interpolation=cv2.INTER_AREA).astype(float)

    return draw


@pytest.fixture
def lattice():
    """(48, 2) positions off the pixel grid at a pitch of 18 px, and (48,) diameters of 5 to 9 px."""
    rng = np.random.default_rng(5)
    row, column = np.divmod(np.arange(48), 8)
    return np.stack([15 + 18.3 * column, 14 + 18.1 * row], 1) + rng.uniform(-0.4, 0.4, (48, 2)), rng.uniform(5, 9, 48)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The four outputs of a position sensitive detector: sums and differences, and the place of the light's centroid (Maekawa et al., eq 1)."""
from __future__ import annotations

import numpy as np

#: Columns: difference along x, along y, total, and the one that is left; rows: the outputs x1, y1, x2, y2.
MIX = np.array([[-1.0, -1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, -1.0]])
X, Y, TOTAL, CROSS = range(4)


def position(sums: np.ndarray) -> np.ndarray:
    """Places (N, 2) of the light's centroid in half widths of the detector, -1 to 1, from sums (N, 4) = net voltages @ MIX; NaN without
    light. This is eq 1 over L_d / 2, without its offset."""
    total = sums[:, TOTAL:CROSS]
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where(total > 0, sums[:, :TOTAL] / total, np.nan)


def position_covariance(place: np.ndarray, total: float, noise: np.ndarray, shot: float) -> np.ndarray:
    """Covariance (2, 2) of a place (2,), in half widths, from total, V.

    noise: (4, 4) covariance of the sums, V^2; shot: V, variance of an output for each V of light on it. To first order: an error of the
    sums counts in proportion to 1 / total, so it grows as the light falls.
    """
    x, y = float(place[0]), float(place[1])
    (xx, xy, xt, _), (_, yy, yt, _), (_, _, tt, _), _ = noise.tolist()
    both = xy - x * yt - y * xt + x * y * tt
    along = xx - 2 * x * xt + x * x * tt + shot * total * (1 - x * x)
    across = yy - 2 * y * yt + y * y * tt + shot * total * (1 - y * y)
    return np.array([[along, both], [both, across]]) / (total * total)

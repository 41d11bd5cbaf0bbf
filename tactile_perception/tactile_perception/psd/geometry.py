# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Places on the hemisphere as angles and unit vectors (Maekawa et al., eqs 6 to 8, 12 to 14), and the four outputs of a position
sensitive detector: sums, differences, and the centroid of the light (eq 1)."""
from __future__ import annotations

import numpy as np


def direction(phi: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Unit normals (..., 3) at azimuth phi and polar angle theta, rad (eq 7)."""
    return np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta) + 0 * phi], axis=-1)


def angles(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Azimuth, in (-pi, pi], 0 at the pole, and polar angle, rad, of unit vectors (..., 3); NaN where one is no number."""
    normal = np.where(np.isfinite(normal), normal, np.nan)
    across = np.hypot(normal[..., 0], normal[..., 1])
    return np.arctan2(normal[..., 1], normal[..., 0]) * (across > 0), np.arctan2(across, normal[..., 2])


def error_angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles, rad, between unit vectors (..., 3) (eqs 12, 13); exact for small ones, where the papers' arc cosine is not."""
    return 2 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0))


def flat(normal: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3) on a plane (..., 2) that keeps the distance to the pole: polar angle times direction of the azimuth, rad."""
    across = np.hypot(normal[..., 0], normal[..., 1])
    theta = np.arctan2(across, np.where(np.isfinite(normal[..., 2]), normal[..., 2], np.nan))
    with np.errstate(invalid='ignore', divide='ignore'):
        return normal[..., :2] * np.where(across > 0, theta / across, 1.0)[..., None]


def bent(plane: np.ndarray) -> np.ndarray:
    """Back from the plane of flat (..., 2), rad, to unit vectors (..., 3)."""
    theta = np.hypot(plane[..., 0], plane[..., 1])
    return np.concatenate([plane * np.sinc(theta / np.pi)[..., None], np.cos(theta)[..., None]], axis=-1)


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

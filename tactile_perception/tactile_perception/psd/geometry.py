# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of the hemisphere (Maekawa et al., eqs 6 to 8, 12, 13) and of the position sensitive detector (eq 1)."""
from __future__ import annotations

import numpy as np

from .._core import place_covariance


def direction(phi: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Unit normals (..., 3) at azimuth phi and polar angle theta, rad (eq 7)."""
    return np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta) + 0 * phi], axis=-1)


def angles(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Azimuth in (-pi, pi], 0 at the pole, and polar angle, rad, of unit vectors (..., 3); NaN for non-finite vectors."""
    normal = np.where(np.isfinite(normal), normal, np.nan)
    across = np.hypot(normal[..., 0], normal[..., 1])
    return np.arctan2(normal[..., 1], normal[..., 0]) * (across > 0), np.arctan2(across, normal[..., 2])


def error_angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles, rad, between unit vectors (..., 3) (eqs 12, 13). The arc sine of half the chord keeps small angles exact."""
    return 2 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0))


def log_map(normal: np.ndarray) -> np.ndarray:
    """Logarithmic map at the pole: unit vectors (..., 3) to tangent vectors (..., 2), rad, whose length is the polar angle."""
    across = np.hypot(normal[..., 0], normal[..., 1])
    theta = np.arctan2(across, np.where(np.isfinite(normal[..., 2]), normal[..., 2], np.nan))
    with np.errstate(invalid='ignore', divide='ignore'):
        return normal[..., :2] * np.where(across > 0, theta / across, 1.0)[..., None]


def exp_map(plane: np.ndarray) -> np.ndarray:
    """Exponential map at the pole, the inverse of log_map: tangent vectors (..., 2), rad, to unit vectors (..., 3)."""
    theta = np.hypot(plane[..., 0], plane[..., 1])
    return np.concatenate([plane * np.sinc(theta / np.pi)[..., None], np.cos(theta)[..., None]], axis=-1)


#: Rows: outputs x1, y1, x2, y2. Columns: difference along x and along y (numerators of eq 1), total (its denominator), cross term.
MIX = np.array([[-1.0, -1.0, 1.0, 1.0], [1.0, -1.0, 1.0, -1.0], [1.0, 1.0, 1.0, 1.0], [-1.0, 1.0, 1.0, -1.0]])
X, Y, TOTAL, CROSS = range(4)


def position(sums: np.ndarray) -> np.ndarray:
    """Centroids (N, 2) of the light on the detector from sums (N, 4) = net voltages @ MIX (eq 1 without its offset).

    In half widths L_d / 2 of the detector, -1 to 1; NaN where the total is not positive.
    """
    total = sums[:, TOTAL:CROSS]
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where(total > 0, sums[:, :TOTAL] / total, np.nan)


def position_covariance(place: np.ndarray, total: float, noise: np.ndarray, shot: float) -> np.ndarray:
    """Covariance (2, 2), half widths squared, of a position (2,) measured with that total, V (first-order propagation of eq 1).

    noise: (4, 4) covariance of the sums, V^2; shot: V, variance of an output per V of its signal.
    """
    return place_covariance(np.asarray(place, float), float(total), np.asarray(noise, float), shot)

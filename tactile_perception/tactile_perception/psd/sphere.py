# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Places on the hemisphere as angles and unit vectors (Maekawa et al., eqs 6 to 8, 12 to 14)."""
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


def tangents(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across normal (3,) and each other."""
    first = np.zeros(3)
    first[np.argmin(np.abs(normal))] = 1.0
    first -= (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])

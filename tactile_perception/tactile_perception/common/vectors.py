# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Products of vectors whose components are rows of an array (3, ...), and tangents of a surface."""
from __future__ import annotations

import numpy as np


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of component-first arrays (3, ...): np.cross without its copies. For arrays (..., 3): cross(a.T, b.T).T."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=out[i, ...])
        out[i] -= a[k] * b[j]
    return out


def tangents(normal: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) across unit normal (3,) and each other; with normal they are a right-handed frame."""
    first = np.zeros(3)
    first[np.argmin(np.abs(normal))] = 1.0
    first -= (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, cross(normal, first)])

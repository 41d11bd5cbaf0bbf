# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Products of vectors whose components are rows of an array (3, ...)."""
from __future__ import annotations

import numpy as np


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of component-first arrays (3, ...): np.cross without its copies."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=out[i])
        out[i] -= a[k] * b[j]
    return out


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar product of component-first arrays (3, ...), without the array of products that a sum would need."""
    return np.einsum('c...,c...->...', a, b)

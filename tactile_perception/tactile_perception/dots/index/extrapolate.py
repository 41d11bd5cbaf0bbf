# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Extrapolates row and column indices over gaps that no link between neighbours bridges, where many dots are missing (kernel
extrapolate_indices: src/dots/index/extrapolate.cpp)."""
from __future__ import annotations

import numpy as np
from tactile_perception._core import extrapolate_indices


def grow(uv: np.ndarray, rc: np.ndarray, member: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices rc (N, 2) int64 and membership (N,) bool, extended to more dots and checked; dots inconsistent with their neighbours lose
    membership.

    uv: (N, 2) px, finite; rc: (N, 2) int64, row and column, valid where member (N,) bool; pitch: px.
    """
    return extrapolate_indices(np.ascontiguousarray(uv, float), rc, member, pitch=pitch)

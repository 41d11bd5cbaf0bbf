# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Relative row and column indices of dots on a printed grid, from one image alone.

The compiled kernel (src/dots/index/lattice.cpp) finds neighbours and propagates indices along them;
indices beyond gaps are extrapolated here.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_perception import _core
from tactile_perception.dots.index.extrapolate import grow

LOOSE = 0.05  # share of dots without an index above which indices are extrapolated: more than false dots alone. Chosen


@dataclass
class Lattice:
    """Relative indices. rc: (N, 2) int64, row and column, valid where member (N,) bool; angle: of the rows from u, rad; pitch: px."""

    rc: np.ndarray
    member: np.ndarray
    angle: float
    pitch: float


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Relative row and column indices of dots, or None if they form no grid.

    uv: (N, 2) px, finite; angle_hint: rad, expected direction of the rows; of the four possible directions, the one within 45 degrees of
    it is returned.
    """
    found = _core.find_lattice(np.ascontiguousarray(uv, float), angle_hint)
    if found is None:
        return None
    rc, member, angle, pitch = found
    if np.count_nonzero(member) < (1 - LOOSE) * len(uv):
        rc, member = grow(uv, rc, member, pitch)
    return Lattice(rc, member, angle, pitch)

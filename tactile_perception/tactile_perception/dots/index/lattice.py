# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Rows and columns of dots on a printed grid, relative to each other, from one image alone.

The compiled kernel (src/lattice.cpp) finds neighbours and propagates indices along them; dots beyond gaps are extrapolated here.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_perception import _core
from tactile_perception.dots.index.extrapolate import grow

LOOSE = 0.05  # of the dots without a number: more are not only false ones


@dataclass
class Lattice:
    """Relative numbers. rc: (N, 2) int64 row and column, valid where member (N,) bool; angle: of the rows against u, rad; pitch: px."""

    rc: np.ndarray
    member: np.ndarray
    angle: float
    pitch: float


def find_lattice(uv: np.ndarray, angle_hint: float = 0.0) -> Lattice | None:
    """Rows and columns of dots at finite uv (N, 2) px relative to each other, or None where they form no grid.

    angle_hint: rad, direction in which rows run; the answer is the one of the four possible within 45 degrees of it.
    """
    found = _core.find_lattice(np.ascontiguousarray(uv, float), angle_hint)
    if found is None:
        return None
    rc, member, angle, pitch = found
    if np.count_nonzero(member) < (1 - LOOSE) * len(uv):
        rc, member = grow(uv, rc, member, pitch)
    return Lattice(rc, member, angle, pitch)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tells what a touch leaves behind (a pad creeps back, a print has shifted) from a touch that goes on.

Displacements alone cannot: both are local and do not move. But a residue is small against the touch before it, and small at all, and has
stayed still for a while; a contact that is held has most of the size that it had at its deepest.
"""
from __future__ import annotations

import numpy as np

RELEASED = 0.15  # of the largest size of a touch: what is less may be its residue
LARGEST = 1.0  # px: no residue is larger
SETTLED_S = 3.0  # s for which it must have stayed still
STILL = 0.1  # px that nearly all dots have moved less than, in that time
NEARLY_ALL = 0.99
NOISE = 7.0  # sigmas: two places of a dot that stays differ by less
GROWN = 1.5  # times its size when it was taken for a residue: it is a touch again


class Release:
    """Follows the size of a touch from frame to frame."""

    def __init__(self):
        self.forget()

    def forget(self) -> None:
        """Nothing touches, and nothing has."""
        self._largest, self._accepted = 0.0, np.nan
        self._since_s, self._id, self._uv = np.inf, np.zeros(0, np.int64), np.zeros((0, 2))

    def is_residue(self, size: float, id: np.ndarray, uv: np.ndarray, sigma: np.ndarray, stamp_s: float) -> bool:
        """Whether displacements of this size (px) of dots id (N,) at uv (N, 2) px, good to sigma (N,) px, are what a touch
        has left."""
        self._largest = max(self._largest, size)
        if not self._stayed(id, uv, max(STILL, NOISE * float(np.sort(sigma)[len(sigma) // 2]))):
            self._since_s, self._id, self._uv, self._accepted = stamp_s, id.copy(), uv.copy(), np.nan
        if np.isfinite(self._accepted):
            return size <= GROWN * self._accepted
        if size > min(RELEASED * self._largest, LARGEST) or stamp_s - self._since_s < SETTLED_S:
            return False
        self._accepted = size
        return True

    def _stayed(self, id, uv, limit) -> bool:
        """Whether the dots are where they were when they were last seen to have moved."""
        now = then = slice(None)
        if not np.array_equal(id, self._id):
            _, now, then = np.intersect1d(id, self._id, assume_unique=True, return_indices=True)
            if len(now) < 0.9 * max(len(id), len(self._id)) or not len(now):
                return False
        moved = uv[now] - self._uv[then]
        square = np.sort(np.einsum('ij,ij->i', moved, moved))
        return bool(square[int(NEARLY_ALL * (len(square) - 1))] < limit * limit)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Detection of the residual displacement after a contact (creep of the pad, shifted print), which looks like a small lasting contact.

A residue is small, small against the contact before it, and still for some time; a contact that is held keeps most of its size.
"""
from __future__ import annotations

import numpy as np
from tactile_perception._core import have_stayed

RELEASED = 0.15  # of the largest size of a contact, largest residue. Chosen
LARGEST = 1.0  # px, largest residue. Chosen
SETTLED_S = 3.0  # s without motion. Chosen
GROWN = 1.5  # times its accepted size, from which a residue is contact again. Chosen


class Release:
    """Tracks the size of a contact from frame to frame."""

    def __init__(self):
        self.forget()

    def forget(self) -> None:
        """Forget the last contact."""
        self._largest, self._accepted = 0.0, np.nan
        self._since_s, self._id, self._uv = np.inf, np.zeros(0, np.int64), np.zeros((0, 2))

    def is_residue(self, size: float, id: np.ndarray, uv: np.ndarray, sigma: np.ndarray, stamp_s: float) -> bool:
        """Whether displacements of this size, px, are the residue of a contact.

        id: (N,), uv: (N, 2) px and sigma: (N,) px, of the dots; stamp_s: s.
        """
        self._largest = max(self._largest, size)
        if not have_stayed(id, uv, sigma, self._id, self._uv):
            self._since_s, self._id, self._uv, self._accepted = stamp_s, id.copy(), uv.copy(), np.nan
        if np.isfinite(self._accepted):
            return size <= GROWN * self._accepted
        if size > min(RELEASED * self._largest, LARGEST) or stamp_s - self._since_s < SETTLED_S:
            return False
        self._accepted = size
        return True

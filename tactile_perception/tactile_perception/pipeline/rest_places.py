# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the dots of a touchpad are while nothing touches, from their untouched places in the image and the cap's shape."""
from __future__ import annotations

import numpy as np

from ..camera import CameraModel
from ..dots.dots import DotTracks
from ..surface.cap import Cap

_MOVED = 0.02  # px: a smaller change of the reference is not worth a new membrane


class RestPlaces:
    """Rest places of all K dots of a grid. xyz: (K, 3) m, NaN for dots never seen untouched; uv: (K, 2) px, the same in the image."""

    def __init__(self, cap: Cap, camera: CameraModel, rows: int, columns: int):
        self._cap, self._camera = cap, camera
        self.uv = np.full((rows * columns, 2), np.nan)
        self.xyz = np.full((rows * columns, 3), np.nan)

    def update(self, tracks: DotTracks) -> bool:
        """Take the untouched places of the dots in tracks; whether any has moved or is new."""
        rest = tracks.rest_uv
        if (np.abs(rest - self.uv[tracks.id]) <= _MOVED).all():  # NaN is not
            return False
        known = np.isfinite(rest).all(axis=1)
        ids, rest = tracks.id[known], rest[known]
        if (np.abs(rest - self.uv[ids]) <= _MOVED).all():
            return False
        self.uv[ids] = rest
        self.xyz[ids] = self._cap.meet(self._camera.centre, self._camera.rays(rest))
        return True

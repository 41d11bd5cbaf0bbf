# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far apart in time two views of one sheet are, from the force balance of the sheet at the seam between them."""
from __future__ import annotations

import numpy as np
from tactile_driver.stitching.calibration import Stitching

from .sensor import MarkerSensor
from .positions import SheetSurface

_TIP = 2.5  # pitches around the deepest marker that carry the load of a tip and are left out; chosen
_CORRELATED = 3.0  # residuals of neighbouring loads agree, so the error is so many times the residual; measured on simulated drags


class SeamBalance:
    """Finds the moment at which the right view of a moving sheet fits the left one.

    Away from the tip nothing loads the sheet: the Laplacian of its depth is 0 (membrane equation), also at the two columns of markers
    beside the seam. Where the views are of different moments, one side is deeper than the other by a share of its motion, and the columns
    carry opposite loads. stitching, sensor: of a sheet whose cameras' places are known.
    """

    def __init__(self, stitching: Stitching, sensor: MarkerSensor):
        grid = sensor.grid()
        self._surface = SheetSurface(grid, sensor.rows, sensor.columns, sensor.size)
        self._stitching = stitching
        self._steps = np.indices((sensor.rows, sensor.columns)).reshape(2, -1).T
        seam = (stitching.seam - stitching.origin[0]) / stitching.scale
        self._beside = np.abs(grid[:, 0] - seam) < sensor.pitch[0]

    def ratio(self, uv: np.ndarray, duv: np.ndarray, move: np.ndarray) -> tuple[float, float]:
        """By which multiple of its last motion the right view has to go on to fit the left one, and the standard deviation.

        uv, duv: (K, 2) px, positions and displacements of all markers, NaN for those not seen; move: (K, 2) px, last motion of those in the
        right view, 0 for the others. NaN and inf where the motion does not reach the seam.
        """
        depth, free = self._depths(uv, np.stack([duv, move]))
        load, change = self._surface.loads(depth)[:, free]
        strength = float(change @ change)
        if not strength > 0:
            return np.nan, np.inf
        ratio = -float(load @ change) / strength
        return ratio, _CORRELATED * float(np.linalg.norm(load + ratio * change)) / np.sqrt(strength)

    def imbalance(self, uv: np.ndarray, duv: np.ndarray) -> float:
        """RMS load at the seam, in units of tension, over the largest depth; uv, duv: as of ratio."""
        depth, free = self._depths(uv, duv[None])
        return float(np.sqrt((self._surface.loads(depth)[:, free]**2).mean()) / np.abs(depth).max())

    def _depths(self, uv: np.ndarray, shifts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depths (M, K), m, by displacements (M, K, 2), px, and which markers (K,) beside the seam are free of the tip's load."""
        place = (uv - self._stitching.origin) / self._stitching.scale
        depth = self._surface.depths(place, shifts / self._stitching.scale, self._stitching.eyes[self._stitching.side_of(uv)])
        tip = np.argmax(np.abs(depth).sum(axis=0))
        return depth, self._beside & (np.hypot(*(self._steps - self._steps[tip]).T) >= _TIP)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Brings markers that the right one of two cameras saw to the exposure of the left one."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
from tactile_driver.stitching.calibration import Stitching

from ..common.dot_grid import scatter
from ..common.dots import DotTracks
from ..markers.places.seam import SeamBalance
from ..markers.view.sensor import MarkerSensor

_UNEVEN = 0.5  # standard deviation of a ratio of motions where speed changes between frames; chosen
_FARTHEST = 3.0  # last motions by which a marker is moved on; chosen
_CLEAR = 0.9  # share of a motion that is not noise from which it counts as clear; noise of 100 markers reaches it once in 200 frames


class RightShutter:
    """Moves the markers of the right view by their own motion between the last two right exposures, frame by frame.

    seam: px, columns of the stitched image beyond it come from the right camera; count: K, of markers; balance: None for steady motion.
    Steady motion goes on by the ratio of the two intervals. Where speed changes, as when a press begins or ends, the balance of the sheet
    at the seam tells the ratio better; both are weighted by their variances.
    A motion m of a marker is known with noise of variance n = 2 (sigma^2 + sigma_before^2), summed over both axes. The part 1 - n / |m|^2
    of it counts, none below 0 (positive-part shrinkage after James and Stein 1961): so markers at rest stay where they are seen. A marker
    without an earlier place in the right view stays too.
    """

    def __init__(self, seam: float, count: int, balance: SeamBalance | None = None):
        self._seam, self._balance = seam, balance
        self._uv, self._sigma, self._area = np.full((count, 2), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        self._time_s = np.full(count, np.nan)

    def process(self, tracks: DotTracks, stamp_s: float, skew_s: float) -> DotTracks:
        """The tracks at the left exposure. tracks: of the stitched image; stamp_s: left exposure, s; skew_s: from it to the right one, s,
        negative where the right one is earlier; 0 leaves the tracks as they are."""
        right = np.flatnonzero(tracks.uv[:, 0] > self._seam)
        id, uv, sigma, area, time_s = tracks.id[right], tracks.uv[right], tracks.sigma[right], tracks.area[right], stamp_s + skew_s
        move, share = self._motion(id, uv, sigma)
        elapsed, before = time_s - self._time_s[id], self._area[id]
        self._uv[id], self._sigma[id], self._area[id], self._time_s[id] = uv, sigma, area, time_s
        if not skew_s or not (share > 0).any():
            return tracks
        ratio = share * np.where(share > 0, self._ratio(tracks, id, move, share, -skew_s / elapsed), 0.0)
        with np.errstate(divide='ignore', invalid='ignore'):
            growth = (area / before)**ratio
        moved = replace(tracks, uv=tracks.uv.copy(), duv=tracks.duv.copy(), area=tracks.area.copy(), sigma=tracks.sigma.copy())
        moved.uv[right] += ratio[:, None] * move
        moved.duv[right] += ratio[:, None] * move
        moved.area[right] *= np.where(np.isfinite(growth), growth, 1.0)
        moved.sigma[right] *= np.hypot(1 + ratio, ratio)
        return moved

    def _motion(self, id: np.ndarray, uv: np.ndarray, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Motion (N, 2), px, since the last right exposure, and the share (N,) of it that counts; both 0 where it is not known."""
        move = np.where(np.isfinite(self._uv[id]), uv - self._uv[id], 0.0)
        with np.errstate(divide='ignore', invalid='ignore'):
            share = 1 - 2 * (sigma**2 + self._sigma[id]**2) / (move**2).sum(axis=1)
        return move, np.where(share > 0, share, 0.0)

    def _ratio(self, tracks: DotTracks, id: np.ndarray, move: np.ndarray, share: np.ndarray, steady: np.ndarray) -> np.ndarray:
        """(N,) by which multiple of its last motion each marker goes on (> 0) or back (< 0); steady: (N,) the same of steady motion."""
        steady = np.clip(steady, -1.0, _FARTHEST)
        if self._balance is None or not (share > _CLEAR).any():
            return steady
        count, usual = len(self._uv), float(np.nanmedian(steady))
        everywhere = scatter(move, id, count)
        everywhere[np.isnan(everywhere)] = 0.0
        found, sigma = self._balance.ratio(scatter(tracks.uv, tracks.id, count), scatter(tracks.duv, tracks.id, count), everywhere)
        if not np.isfinite(found):
            return steady
        weight = 1 / (1 + (sigma / _UNEVEN)**2)
        told = np.clip(usual + weight * (found - usual), *((-1.0, 0.0) if usual < 0 else (0.0, _FARTHEST)))
        return steady * told / usual


def right_shutter(stitching: Stitching | None, sensor: MarkerSensor) -> RightShutter | None:
    """For the picture of two cameras with that stitching; None for one camera. Without known places of the cameras motion counts as
    steady."""
    if stitching is None:
        return None
    known = np.isfinite(stitching.eyes).all()
    return RightShutter(stitching.seam, sensor.rows * sensor.columns, SeamBalance(stitching, sensor) if known else None)

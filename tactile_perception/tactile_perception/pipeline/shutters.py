# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Brings markers that the right one of two cameras saw to the exposure of the left one."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..common.dots import DotTracks


class RightShutter:
    """Moves the markers of the right view by their own motion between the last two right exposures, frame by frame.

    seam: px, columns of the stitched image beyond it come from the right camera; count: K, of markers.
    A motion m of a marker is known with noise of variance n = 2 (sigma^2 + sigma_before^2), summed over both axes. The part 1 - n / |m|^2
    of it counts, none below 0 (positive-part shrinkage after James and Stein 1961): so markers at rest stay where they are seen. A marker
    without an earlier place in the right view stays too.
    """

    def __init__(self, seam: float, count: int):
        self._seam = seam
        self._uv, self._sigma, self._area = np.full((count, 2), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        self._time_s = np.full(count, np.nan)

    def process(self, tracks: DotTracks, stamp_s: float, skew_s: float) -> DotTracks:
        """The tracks at the left exposure. tracks: of the stitched image; stamp_s: left exposure, s; skew_s: from it to the right one, s,
        negative where the right one is earlier; 0 leaves the tracks as they are."""
        right = np.flatnonzero(tracks.uv[:, 0] > self._seam)
        some, id = tracks.take(right), tracks.id[right]
        ratio = self._ratio(some, stamp_s + skew_s, skew_s)
        with np.errstate(divide='ignore', invalid='ignore'):
            growth = (some.area / self._area[id])**ratio
        shift = np.where(ratio[:, None], ratio[:, None] * (some.uv - self._uv[id]), 0.0)
        self._uv[id], self._sigma[id], self._area[id], self._time_s[id] = some.uv, some.sigma, some.area, stamp_s + skew_s
        if not skew_s:
            return tracks
        uv, duv, area, sigma = tracks.uv.copy(), tracks.duv.copy(), tracks.area.copy(), tracks.sigma.copy()
        uv[right] += shift
        duv[right] += shift
        area[right] *= np.where(np.isfinite(growth), growth, 1.0)
        sigma[right] *= np.hypot(1 + ratio, ratio)
        return replace(tracks, uv=uv, duv=duv, area=area, sigma=sigma)

    def _ratio(self, some: DotTracks, time_s: float, skew_s: float) -> np.ndarray:
        """(N,) by which share of its last motion each marker, exposed at time_s, goes on (> 0) or back (< 0): at most one motion."""
        id = some.id
        with np.errstate(divide='ignore', invalid='ignore'):
            ratio = np.clip(-skew_s / (time_s - self._time_s[id]), -1.0, 1.0)
            noise = 2 * (some.sigma**2 + self._sigma[id]**2)
            share = 1 - noise / ((some.uv - self._uv[id])**2).sum(axis=1)
        return np.where(share > 0, ratio * share, 0.0)  # NaN, of an unknown earlier place: 0

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the markers look like while nothing touches, and from it the field of each frame."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..dots.dots import DotTracks
from .field import MarkerField
from .view import MarkerView, marker_field

_MOVED = 0.3  # px: a reference that moved by more is another one
_STILL = 0.3  # px: a marker that is displaced by less tells its untouched area
_FRAMES = 30  # over which the untouched area is averaged


class RestMarkers:
    """Untouched places and areas of the K markers of a pattern, followed frame by frame.

    make_view: view of the untouched markers' places (K, 2) px, NaN where not seen; may raise BadFrame. uv: (K, 2) px; area: (K,) px^2.
    """

    def __init__(self, count: int, make_view: Callable[[np.ndarray], MarkerView]):
        self._make_view = make_view
        self.uv, self.area = np.full((count, 2), np.nan), np.full(count, np.nan)
        self._frames = np.zeros(count)
        self._view_uv: np.ndarray | None = None
        self._view: MarkerView | None = None

    def field(self, tracks: DotTracks) -> MarkerField:
        """The field of one frame, whose numbers are below K. Raises BadFrame where there is no view, BadArgument for other numbers."""
        self._follow(tracks)
        if self._view is None or self._has_moved():
            self._view, self._view_uv = self._make_view(self.uv), self.uv.copy()
        return marker_field(tracks, self.area, self._view)

    def _follow(self, tracks: DotTracks) -> None:
        inside = (tracks.id >= 0) & (tracks.id < len(self.uv))
        known = np.flatnonzero(inside & np.isfinite(tracks.duv).all(1))
        id = tracks.id[known]
        rest = tracks.uv[known] - tracks.duv[known]
        anew = ~(np.abs(rest - self.uv[id]).max(1, initial=0.0) <= _MOVED)  # NaN is not
        self._frames[id[anew]] = 0
        self.uv[id] = rest
        still = known[np.abs(tracks.duv[known]).max(1, initial=0.0) <= _STILL]
        id, area = tracks.id[still], tracks.area[still]
        self._frames[id] = np.minimum(self._frames[id] + 1, _FRAMES)
        first = self._frames[id] == 1
        self.area[id] = np.where(first, area, self.area[id] + (area - self.area[id]) / self._frames[id])

    def _has_moved(self) -> bool:
        moved = np.abs(self.uv - self._view_uv)
        return bool((np.isnan(self._view_uv) & ~np.isnan(self.uv)).any() or (moved > _MOVED).any())

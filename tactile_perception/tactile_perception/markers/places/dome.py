# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of a dome's markers."""
from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ...common.dots import DotTracks
from ..view.marker_field import MarkerField, MarkerView, RestMarkers
from ..view.sensor import MarkerSensor, rest_points

_STILL = 1e-4  # m, apparent: without a calibration, the height of a marker displaced by more is unknown. Chosen


class DomeMethod(Protocol):
    """A touch method that tells how far the dome's markers are lowered."""

    def raised(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray | None] | None:
        """Upward displacement (K,), m, of the markers; and the places (n, 2), m, of the dents if it is known but for the scale about the
        eye, else None. None without contact."""


class DomePlaces:
    """3D positions of a dome's markers, each on its ray from the eye.

    One camera cannot observe the scale about the eye. The mechanics know it; the learned dents (dome_basis) do not fix it: it is estimated
    from the skin that is not touched, which hardly moves (see still_scale).

    count: of the markers; make_view: see RestMarkers; method: estimates the touches; None: not calibrated, displaced markers are NaN.
    """

    def __init__(self, sensor: MarkerSensor, count: int, make_view: Callable[[np.ndarray], MarkerView], method: DomeMethod | None):
        self._sensor, self._count, self._make_view, self._method = sensor, count, make_view, method
        self.renew()

    def renew(self) -> None:
        """Start with a new reference."""
        self._rest = RestMarkers(self._count, self._make_view)

    def locate(self, _image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """Positions (N, 3), m, sensor frame, of tracks; NaN where unknown. Raises BadFrame where there is no view."""
        field = self._rest.field(tracks)
        rest = rest_points(field.rest, field.eye, self._sensor)
        raised, dents = (self._method and self._method.raised(field)) or (self._undented(field), None)
        seen = np.column_stack([field.rest + field.shift, np.full(len(field), self._sensor.plane_z)])
        share = (rest[:, 2] + raised - field.eye[:, 2]) / (self._sensor.plane_z - field.eye[:, 2])
        from_eye = share[:, None] * (seen - field.eye)
        if dents is not None:
            from_eye *= still_scale(from_eye, rest - field.eye, _distances(rest, dents))
        return (field.eye + from_eye)[tracks.id]

    def _undented(self, field: MarkerField) -> np.ndarray:
        """(K,) m, upward displacement without a dent: 0; if not calibrated, NaN for displaced markers."""
        return np.where((self._method is not None) | (np.hypot(*field.shift.T) <= _STILL), 0.0, np.nan)


def _distances(rest: np.ndarray, dents: np.ndarray) -> np.ndarray:
    """(K,) m, horizontal distance from markers at rest (K, 3) m to the nearest of dents (n, 2)."""
    return np.hypot(*(rest[:, None, :2] - dents).transpose(2, 0, 1)).min(axis=1)


def still_scale(now: np.ndarray, rest: np.ndarray, distance: np.ndarray) -> float:
    """Scale about the eye that minimises the motion of the half of the markers farthest from the dents; 1 where none is known.

    now, rest: (K, 3) m, markers relative to the eye; distance: (K,) m from the dents; NaN where unknown.
    """
    known = np.isfinite(now).all(axis=1) & np.isfinite(rest).all(axis=1) & np.isfinite(distance)
    if not known.any():
        return 1.0
    far = known & (distance >= np.median(distance[known]))
    return float(np.sum(now[far] * rest[far]) / np.sum(now[far]**2))

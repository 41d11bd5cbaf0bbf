# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of a dome's markers."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.dots import DotTracks
from ..regression.dome import DomeRegression
from ..view.marker_field import MarkerField, MarkerView, RestMarkers
from ..view.sensor import MarkerSensor, rest_points

_STILL = 1e-4  # m, apparent: without a calibration, the height of a marker displaced by more is unknown. Chosen


class DomePlaces:
    """3D positions of a dome's markers, each on its ray from the eye.

    One camera cannot observe the scale about the eye, and the learned dents (dome_basis) do not fix it. It is estimated from the skin that
    is not touched, which does not move (see still_scale).

    count: of the markers; make_view: see RestMarkers; method: estimates the dents; None: not calibrated, displaced markers are NaN.
    """

    def __init__(self, sensor: MarkerSensor, count: int, make_view: Callable[[np.ndarray], MarkerView], method: DomeRegression | None):
        self._sensor, self._count, self._make_view, self._method = sensor, count, make_view, method
        self.renew()

    def renew(self) -> None:
        """Start with a new reference."""
        self._rest = RestMarkers(self._count, self._make_view)

    def locate(self, _image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """Positions (N, 3), m, sensor frame, of tracks; NaN where unknown. Raises BadFrame where there is no view."""
        field = self._rest.field(tracks)
        rest = rest_points(field.rest, field.eye, self._sensor)
        found = None if self._method is None else self._method.dents(field)
        raised = self._undented(field) if found is None else self._method.solver.moved(found)[:, 2]
        seen = np.column_stack([field.rest + field.shift, np.full(len(field), self._sensor.plane_z)])
        share = (rest[:, 2] + raised - field.eye[:, 2]) / (self._sensor.plane_z - field.eye[:, 2])
        from_eye = share[:, None] * (seen - field.eye)
        if found is not None:
            from_eye *= still_scale(from_eye, rest - field.eye, _distances(rest, found.parameters))
        return (field.eye + from_eye)[tracks.id]

    def _undented(self, field: MarkerField) -> np.ndarray:
        """(K,) m, upward displacement without a dent: 0; if not calibrated, NaN for displaced markers."""
        return np.where((self._method is not None) | (np.hypot(*field.shift.T) <= _STILL), 0.0, np.nan)


def _distances(rest: np.ndarray, dents: np.ndarray) -> np.ndarray:
    """(K,) m, horizontal distance from markers at rest (K, 3) m to the nearest of dents (n, 4)."""
    return np.hypot(*(rest[:, None, :2] - dents[:, :2]).transpose(2, 0, 1)).min(axis=1)


def still_scale(now: np.ndarray, rest: np.ndarray, distance: np.ndarray) -> float:
    """Scale about the eye that minimises the motion of the half of the markers farthest from the dents; 1 where none is known.

    now, rest: (K, 3) m, markers relative to the eye; distance: (K,) m from the dents; NaN where unknown.
    """
    known = np.isfinite(now).all(axis=1) & np.isfinite(rest).all(axis=1) & np.isfinite(distance)
    if not known.any():
        return 1.0
    far = known & (distance >= np.median(distance[known]))
    return float(np.sum(now[far] * rest[far]) / np.sum(now[far]**2))

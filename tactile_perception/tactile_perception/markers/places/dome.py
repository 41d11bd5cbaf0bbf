# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the markers of a dome are in 3D, frame by frame."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.dots import DotTracks
from ..regression.dome import DomeRegression
from ..view.marker_field import MarkerField, MarkerView, RestMarkers
from ..view.sensor import MarkerSensor, rest_points

_STILL = 1e-4  # m, in the viewing plane: without a calibration, a marker that moved by more has no known height


class DomePlaces:
    """Places of a dome's markers, each on the ray on which it is seen.

    A dome that shrinks towards the eye looks the same as before: one camera cannot tell the scale of the dented dome, and the learned dents
    (dome_basis) leave it open. It is taken from the skin that nothing touches, which stays where it was (see still_scale).

    count: of the markers; make_view: see RestMarkers; method: tells the dents; None: not calibrated, markers that moved have no place.
    """

    def __init__(self, sensor: MarkerSensor, count: int, make_view: Callable[[np.ndarray], MarkerView], method: DomeRegression | None):
        self._sensor, self._count, self._make_view, self._method = sensor, count, make_view, method
        self.renew()

    def renew(self) -> None:
        """A new reference is taken."""
        self._rest = RestMarkers(self._count, self._make_view)

    def locate(self, _image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """Places (N, 3), m, sensor frame, of tracks; NaN where not known. Raises BadFrame where there is no view."""
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
        """(K,) m, upwards, where no dent is found: 0; not calibrated, NaN for markers that moved."""
        return np.where((self._method is not None) | (np.hypot(*field.shift.T) <= _STILL), 0.0, np.nan)


def _distances(rest: np.ndarray, dents: np.ndarray) -> np.ndarray:
    """(K,) m, sideways, from markers at rest (K, 3) m to the nearest of dents (n, 4)."""
    return np.hypot(*(rest[:, None, :2] - dents[:, :2]).transpose(2, 0, 1)).min(axis=1)


def still_scale(now: np.ndarray, rest: np.ndarray, distance: np.ndarray) -> float:
    """The scale about the eye at which the half of the markers furthest from the dents moves least (least squares); 1 where none is known.

    now, rest: (K, 3) m, markers as seen from the eye; distance: (K,) from the dents; NaN where not known.
    """
    known = np.isfinite(now).all(axis=1) & np.isfinite(rest).all(axis=1) & np.isfinite(distance)
    if not known.any():
        return 1.0
    far = known & (distance >= np.median(distance[known]))
    return float(np.sum(now[far] * rest[far]) / np.sum(now[far]**2))

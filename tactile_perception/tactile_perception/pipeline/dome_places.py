# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the markers of a dome are in 3D, frame by frame."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..dots.dots import DotTracks
from ..touch.field import MarkerField
from ..touch.regression_dome import DomeRegression
from ..touch.rest_markers import RestMarkers
from ..touch.rest_surface import rest_points
from ..touch.sensor import MarkerSensor
from ..touch.view import MarkerView

_STILL = 1e-4  # m, in the viewing plane: without a calibration, a marker that moved by more has no known height


class DomePlaces:
    """Places of a dome's markers: on the ray on which each is seen, at its untouched height less what the dent takes it down.

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
        height = rest_points(field.rest, field.eye, self._sensor)[:, 2] + self._lowered(field)
        share = (height - field.eye[:, 2]) / (self._sensor.plane_z - field.eye[:, 2])
        xy = field.eye[:, :2] + share[:, None] * (field.rest + field.shift - field.eye[:, :2])
        xy[np.isnan(height)] = np.nan
        return np.column_stack([xy, height])[tracks.id]

    def _lowered(self, field: MarkerField) -> np.ndarray:
        """(K,) m, upwards."""
        if self._method is None:
            return np.where(np.hypot(*field.shift.T) <= _STILL, 0.0, np.nan)
        found = self._method.dents(field)
        return np.zeros(len(field)) if found is None else self._method.solver.moved(found)[:, 2]

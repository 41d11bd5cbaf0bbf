# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of a dome's markers."""
from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ...common.dots import DotTracks
from ..field import MarkerField, MarkerView, RestMarkers
from ..sensor import MarkerSensor, rest_points

_STILL = 1e-4  # m, apparent: without a calibration, the height of a marker displaced by more is unknown. Chosen


class DomeMethod(Protocol):
    """A touch method that tells how far the dome's markers are lowered."""

    def raised(self, field: MarkerField) -> np.ndarray | None:
        """Upward displacement (K,), m, of the markers; None without contact."""


class DomePlaces:
    """3D positions of a dome's markers, each on its ray from the eye.

    One camera cannot observe the scale about the eye; the method knows it from the mechanics.

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
        raised = None if self._method is None else self._method.raised(field)
        raised = self._undented(field) if raised is None else raised
        seen = np.column_stack([field.rest + field.shift, np.full(len(field), self._sensor.plane_z)])
        share = (rest[:, 2] + raised - field.eye[:, 2]) / (self._sensor.plane_z - field.eye[:, 2])
        return (field.eye + share[:, None] * (seen - field.eye))[tracks.id]

    def _undented(self, field: MarkerField) -> np.ndarray:
        """(K,) m, upward displacement without a dent: 0; if not calibrated, NaN for displaced markers."""
        return np.where((self._method is not None) | (np.hypot(*field.shift.T) <= _STILL), 0.0, np.nan)

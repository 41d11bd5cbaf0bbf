# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the markers of a sheet are in 3D, frame by frame."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..dots.dots import DotTracks
from ..surface.sheet import SheetSurface
from ..touch.rest_markers import RestMarkers
from ..touch.sensor import MarkerSensor
from ..touch.view import MarkerView


class SheetPlaces:
    """Places of a sheet's markers; make_view: see RestMarkers. Raises BadArgument for a sensor that is no sheet with a grid."""

    def __init__(self, sensor: MarkerSensor, make_view: Callable[[np.ndarray], MarkerView]):
        self._surface = SheetSurface(sensor.grid(), sensor.rows, sensor.columns, sensor.size)
        self._make_view, self._count = make_view, sensor.rows * sensor.columns
        self.renew()

    def renew(self) -> None:
        """A new reference is taken."""
        self._rest = RestMarkers(self._count, self._make_view)

    def locate(self, _image: np.ndarray, tracks: DotTracks) -> np.ndarray:
        """Places (N, 3), m, sensor frame, of tracks; NaN for one without an untouched place. Raises BadFrame where there is no view."""
        field = self._rest.field(tracks)
        return self._surface.places(field.rest + field.shift, field.shift, field.eye)[tracks.id]

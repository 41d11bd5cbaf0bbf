# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of markers: of a clamped elastic sheet from their apparent positions in its untouched plane, of a dome along their rays."""
from __future__ import annotations

import numpy as np

from .. import _core
from ..common.marker_sensor import MarkerSensor
from ..core.errors import BadArgument
from .constants import PRESS
from .field import MarkerField

# Weights of the in-plane strain and of the bending energy relative to the misfit in the image, with lengths in pitches. The first separates
# in-plane from apparent displacement, the second only smooths; results change little over a decade of either.


def sheet_surface(sensor: MarkerSensor) -> _core.press.SheetSurface:
    """Make the energies of a clamped elastic sheet, whose minimum determines the heights of its markers.

    Raises BadArgument for a sensor that is not a sheet with a grid of at least 3 x 3 markers on it.
    """
    rest, rows, columns, size = sensor.grid(), sensor.rows, sensor.columns, sensor.size
    if not sensor.is_sheet or min(rows, columns) < 3 or not (np.abs(rest) < 0.5 * np.asarray(size)).all():
        raise BadArgument(f'sheet: {rows} x {columns} markers (at least 3 x 3) must lie on the clamped sheet of {size} m')
    laplacian = _laplacian(rest.reshape(rows, columns, 2), np.asarray(size, float))
    stiff = PRESS.strain_weight * laplacian
    strain = stiff @ np.linalg.inv(np.eye(len(rest)) + stiff)
    return _core.press.SheetSurface(PRESS.bending_weight * laplacian @ laplacian, 0.5 * (strain + strain.T), laplacian)


def _laplacian(grid: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Negative Laplacian (K, K) on a grid (rows, columns, 2), m, in units of the mean pitch, with zero displacement at the clamp."""
    rows, columns = grid.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    flat = grid.reshape(-1, 2)
    pitch = np.array([np.median(np.diff(grid[..., 0], axis=1)), np.median(np.diff(grid[..., 1], axis=0))])
    weight = np.mean(pitch)**2 / pitch**2
    found = np.zeros((len(flat), len(flat)))
    for axis, (near, far) in enumerate(((number[:, :-1], number[:, 1:]), (number[:-1], number[1:]))):
        near, far = near.ravel(), far.ravel()
        np.add.at(found, (near, near), weight[axis])
        np.add.at(found, (far, far), weight[axis])
        found[near, far] = found[far, near] = -weight[axis]
        ends = number[:, [0, -1]] if axis == 0 else number[[0, -1]].T
        gap = np.maximum(0.5 * size[axis] - np.abs(flat[ends.ravel(), axis]), PRESS.min_clamp_distance * pitch[axis])
        np.add.at(found, (ends.ravel(), ends.ravel()), weight[axis] * pitch[axis] / gap)
    return found


def dome_raised(method, field: MarkerField) -> np.ndarray:
    """Upward displacements (K,), m, of a dome's markers.

    method: estimates them; None without a calibration, when that of displaced markers is NaN. One camera cannot observe the scale about the
    camera centre; the method knows it from the mechanics.
    """
    raised = None if method is None else method.raised(field)
    if raised is not None:
        return raised
    return np.where((method is not None) | (np.hypot(*field.shift.T) <= PRESS.max_untouched_shift), 0.0, np.nan)


class MarkerPositions:
    """3D positions of markers. method: estimates the heights of a dome's markers; None without a calibration."""

    def __init__(self, sensor: MarkerSensor, method=None):
        self._surface, self._method = sensor.surface, method
        self._sheet = sheet_surface(sensor) if sensor.is_sheet else None

    def raised(self, field: MarkerField) -> np.ndarray:
        """Upward displacements (K,), m, of the markers; NaN if unknown."""
        return self._sheet.raised(field.rest, field.shift, field.camera_centre) if self._sheet else dome_raised(self._method, field)

    def xyz(self, field: MarkerField) -> np.ndarray:
        """Positions (K, 3), m, in the sensor frame of the markers, on their rays from the camera centre; NaN if unknown."""
        return self._surface.raised_points(field.rest, field.shift, field.camera_centre, self.raised(field))

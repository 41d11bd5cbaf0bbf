# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""3D positions of markers: of a clamped elastic sheet from their apparent positions in its untouched plane, of a dome along their rays."""
from __future__ import annotations

from functools import partial

import numpy as np

from ..common.marker_sensor import MarkerSensor, rest_points
from ..core.errors import BadArgument
from .constants import PRESS
from .field import MarkerField

# Weights of the in-plane strain and of the bending energy relative to the misfit in the image, with lengths in pitches. The first separates
# in-plane from apparent displacement, the second only smooths; results change little over a decade of either.


class SheetSurface:
    """A clamped elastic sheet: the heights of its markers from the minimum of strain and bending energy.

    Raises BadArgument for a sensor that is not a sheet with a grid of at least 3 x 3 markers on it.
    """

    def __init__(self, sensor: MarkerSensor):
        rest, rows, columns, size = sensor.grid(), sensor.rows, sensor.columns, sensor.size
        if not sensor.is_sheet or min(rows, columns) < 3 or not (np.abs(rest) < 0.5 * np.asarray(size)).all():
            raise BadArgument(f'sheet: {rows} x {columns} markers (at least 3 x 3) must lie on the clamped sheet of {size} m')
        self._laplacian = _laplacian(rest.reshape(rows, columns, 2), np.asarray(size, float))
        stiff = PRESS.strain_weight * self._laplacian
        strain = stiff @ np.linalg.inv(np.eye(len(rest)) + stiff)
        self._strain = 0.5 * (strain + strain.T)
        self._bending = PRESS.bending_weight * self._laplacian @ self._laplacian

    def raised(self, field: MarkerField) -> np.ndarray:
        """Heights (K,), m, of the markers over the untouched plane; those not visible are interpolated from their neighbours."""
        position, shift, camera_centre, seen = field.rest + field.shift, field.shift, field.camera_centre, field.seen
        if not seen.any():
            return np.full(len(shift), np.nan)
        slope = np.where(seen[:, None], position - camera_centre[:, :2], 0.0) / np.where(seen, -camera_centre[:, 2], 1.0)[:, None]
        slope, shift = (self._fill(values, seen) for values in (slope, np.where(seen[:, None], shift, 0.0)))
        # A depth w moves a marker by slope w in the image; the remaining displacement is strain in the plane. With the strain's energy S
        # and the bending's B: (B + sum over axes of slope S slope) w = sum over axes of slope S shift.
        return -np.linalg.solve(self._bending + self._strain * (slope @ slope.T), (slope * (self._strain @ shift)).sum(axis=1))

    def _fill(self, values: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Interpolate values (K, 2) of the markers that are not visible (harmonic)."""
        if seen.all():
            return values
        filled = values.copy()
        lost = np.flatnonzero(~seen)
        filled[lost] = np.linalg.solve(self._laplacian[np.ix_(lost, lost)], -self._laplacian[lost][:, seen] @ values[seen])
        return filled


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


def on_rays(field: MarkerField, raised: np.ndarray, sensor: MarkerSensor) -> np.ndarray:
    """Positions (K, 3), m, in the sensor frame of markers on their rays from the camera centre, raised by (K,), m; NaN if not visible."""
    rest = rest_points(field.rest, field.camera_centre, sensor)
    seen = np.column_stack([field.rest + field.shift, np.full(len(field), sensor.plane_z)])
    share = (rest[:, 2] + raised - field.camera_centre[:, 2]) / (sensor.plane_z - field.camera_centre[:, 2])
    positions = field.camera_centre + share[:, None] * (seen - field.camera_centre)
    return np.where(field.seen[:, None], positions, np.nan)


class MarkerPositions:
    """3D positions of markers. method: estimates the heights of a dome's markers; None without a calibration."""

    def __init__(self, sensor: MarkerSensor, method=None):
        self._sensor = sensor
        self._raised = SheetSurface(sensor).raised if sensor.is_sheet else partial(dome_raised, method)

    def xyz(self, field: MarkerField, id: np.ndarray) -> np.ndarray:
        """Positions (N, 3), m, in the sensor frame of the markers id (N,) of a field; NaN if unknown."""
        return on_rays(field, self._raised(field), self._sensor)[id]

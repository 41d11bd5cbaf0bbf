# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of the sensors with markers: untouched marker positions in 3D, surface normals, height of first contact."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..common.geometry import Cap
from ..errors import BadArgument
from ..sensors import MARKER_SENSOR_TYPES, MarkerSensorType


@dataclass(frozen=True)
class MarkerSensor(MarkerSensorType):
    """A sheet clamped along a rectangle, or an inflated dome on a round rim.

    type: as in the launch file; rows, columns: 0 for an irregular pattern. Raises BadArgument for dimensions of neither sheet nor dome.
    """

    type: str = ''

    def __post_init__(self):
        sheet, dome = min(self.size) > 0, self.rim_radius > 0 and self.height > 0
        if sheet == dome or min(self.pitch) <= 0 or min(self.rows, self.columns) < 0:
            raise BadArgument(f'marker sensor: give pitch > 0 and either size (a sheet) or rim_radius and height (a dome), got {self}')

    @property
    def is_sheet(self) -> bool:
        """Whether the untouched surface is the plane z = 0."""
        return min(self.size) > 0

    @property
    def plane_z(self) -> float:
        """Height of the viewing plane in the sensor frame, m: the untouched sheet, or the top of the dome."""
        return 0.0 if self.is_sheet else self.height

    def normal(self, place: np.ndarray) -> np.ndarray:
        """(3,) unit normal, outwards, of the untouched surface over place (2,) m; outside a dome's rim that at the rim."""
        if self.is_sheet:
            return np.array([0.0, 0.0, 1.0])
        curvature = (self.rim_radius**2 + self.height**2) / (2 * self.height)
        x, y = np.asarray(place, float).tolist()
        inside = min(1.0, self.rim_radius / max(math.hypot(x, y), 1e-12)) / curvature
        return np.array([x * inside, y * inside, math.sqrt(max(1 - (x * x + y * y) * inside**2, 0.0))])

    def grid(self) -> np.ndarray:
        """(rows * columns, 2) nominal untouched marker positions, m, in sensor x and y, in the order of the marker ids."""
        row, column = np.divmod(np.arange(self.rows * self.columns), max(self.columns, 1))
        middle = (self.columns - 1) / 2, (self.rows - 1) / 2
        return np.stack([column - middle[0], row - middle[1]], axis=1) * self.pitch


#: Name -> nominal geometry.
MARKER_SENSORS = {name: MarkerSensor(**vars(kind), type=name) for name, kind in MARKER_SENSOR_TYPES.items()}


def dome_cap(sensor: MarkerSensor) -> Cap:
    """The spherical cap over a dome's rim."""
    return Cap((sensor.rim_radius**2 + sensor.height**2) / (2 * sensor.height), sensor.height)


def rest_points(rest: np.ndarray, camera_centre: np.ndarray, sensor: MarkerSensor) -> np.ndarray:
    """Positions (K, 3) m of untouched markers that camera_centres (K, 3) m see at rest (K, 2) m in the viewing plane; NaN where unknown."""
    appear = np.column_stack([rest, np.full(len(rest), sensor.plane_z)])
    if sensor.is_sheet:
        return appear
    rays = appear - camera_centre
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return dome_cap(sensor).meet(camera_centre, rays)


def first_touch_height(xy: np.ndarray, tip_radius: float, sensor: MarkerSensor) -> np.ndarray:
    """Heights (N,) m of a round tip's lowest point at first contact, coming down at xy (N, 2) m; NaN beyond the dome."""
    xy = np.atleast_2d(xy)
    if sensor.is_sheet:
        return np.zeros(len(xy))
    cap = dome_cap(sensor)
    inside = (cap.curvature_radius + tip_radius)**2 - np.sum(xy**2, axis=1)
    return cap.centre_z + np.sqrt(np.where(inside >= 0, inside, np.nan)) - tip_radius

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Geometry of the sensors with markers: untouched marker positions in 3D, surface normals, height of first contact."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import _core
from ..core.errors import BadArgument
from .geometry import Cap


@dataclass(frozen=True)
class MarkerSensor:
    """A sheet clamped along a rectangle, or an inflated dome on a round rim, with printed markers.

    Parameters
    ----------
    rows, columns : int
        Of the printed grid; 0 for an irregular pattern.
    pitch : tuple of float, shape (2,)
        Distance of neighbouring markers along x and y, in m.
    size : tuple of float, shape (2,)
        Size of a clamped sheet along x and y, in m; zeros for a dome.
    rim_radius, height : float
        Of a dome, in m; 0 for a sheet.
    type : str
        Name of the sensor type.

    Raises
    ------
    BadArgument
        For dimensions of neither a sheet nor a dome.
    """

    rows: int
    columns: int
    pitch: tuple[float, float]
    size: tuple[float, float] = (0.0, 0.0)
    rim_radius: float = 0.0
    height: float = 0.0
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

    @cached_property
    def surface(self) -> _core.press.MarkerSurface:
        """The undeformed surface, for kernels."""
        return _core.press.MarkerSurface(size=np.array(self.size, float), rim_radius=self.rim_radius, height=self.height)

    def normal(self, xy: np.ndarray) -> np.ndarray:
        """(3,) unit normal, outwards, of the undeformed surface at xy (2,), m; outside a dome's rim that at the rim."""
        return self.surface.normal(np.asarray(xy, float))

    def grid(self) -> np.ndarray:
        """(rows * columns, 2) nominal untouched marker positions, m, in sensor x and y, in the order of the marker ids."""
        row, column = np.divmod(np.arange(self.rows * self.columns), max(self.columns, 1))
        middle = (self.columns - 1) / 2, (self.rows - 1) / 2
        return np.stack([column - middle[0], row - middle[1]], axis=1) * self.pitch


#: Name of the sensor type -> geometry in its paper, areal_sensor_contact_position and air_cushion_contact.
MARKER_SENSORS = {sensor.type: sensor for sensor in (
    MarkerSensor(9, 13, (4.5e-3, 4.5e-3), (0.060, 0.045), type='areal_single'),
    MarkerSensor(11, 14, (9.4e-3, 8.2e-3), (0.133, 0.091), type='areal_dual'),
    MarkerSensor(17, 17, (15.5e-3, 15.5e-3), rim_radius=0.150, height=0.120, type='air_cushion'))}


def dome_cap(sensor: MarkerSensor) -> Cap:
    """The spherical cap over a dome's rim."""
    return Cap((sensor.rim_radius**2 + sensor.height**2) / (2 * sensor.height), sensor.height)


def rest_points(rest: np.ndarray, camera_centre: np.ndarray, sensor: MarkerSensor) -> np.ndarray:
    """Positions (K, 3) m of untouched markers that camera_centres (K, 3) m see at rest (K, 2) m in the viewing plane; NaN where unknown."""
    return sensor.surface.rest_points(rest, camera_centre)


def first_touch_height(xy: np.ndarray, tip_radius: float, sensor: MarkerSensor) -> np.ndarray:
    """Heights (N,) m of a round tip's lowest point at first contact, coming down at xy (N, 2) m; NaN beyond the dome."""
    xy = np.atleast_2d(xy)
    if sensor.is_sheet:
        return np.zeros(len(xy))
    cap = dome_cap(sensor)
    inside = (cap.curvature_radius + tip_radius)**2 - np.sum(xy**2, axis=1)
    return cap.centre_z + np.sqrt(np.where(inside >= 0, inside, np.nan)) - tip_radius

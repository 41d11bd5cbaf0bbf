# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sensors with markers on a surface, as far as contact estimation has to know them."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument


@dataclass(frozen=True)
class MarkerSensor:
    """A sheet clamped along a rectangle, or an inflated dome on a round rim.

    type: as in the launch file; rows, columns: of the printed grid, 0 for a pattern that is no grid; pitch: (2,) m along x and y;
    size: (2,) m of the clamped sheet, (0, 0) for a dome; rim_radius, height: m of a dome, 0 for a sheet. Raises BadArgument for
    numbers that fit neither.
    """

    type: str
    rows: int
    columns: int
    pitch: tuple[float, float]
    size: tuple[float, float] = (0.0, 0.0)
    rim_radius: float = 0.0
    height: float = 0.0

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
        """(3,) unit normal, outwards, of the untouched surface over place (2,) m; over a dome's rim and beyond it that of the rim."""
        if self.is_sheet:
            return np.array([0.0, 0.0, 1.0])
        curvature = (self.rim_radius**2 + self.height**2) / (2 * self.height)
        across = np.asarray(place, float) / curvature
        across = across * min(1.0, self.rim_radius / curvature / max(np.hypot(*across), 1e-12))
        return np.r_[across, np.sqrt(max(1 - across @ across, 0.0))]

    def grid(self) -> np.ndarray:
        """(rows * columns, 2) nominal untouched places of the markers over the sensor's x and y, m, in the order of their numbers."""
        row, column = np.divmod(np.arange(self.rows * self.columns), max(self.columns, 1))
        middle = (self.columns - 1) / 2, (self.rows - 1) / 2
        return np.stack([column - middle[0], row - middle[1]], axis=1) * self.pitch


MARKER_SENSORS = {
    'areal_single': MarkerSensor('areal_single', 9, 13, (4.5e-3, 4.5e-3), (0.060, 0.045)),
    'areal_dual': MarkerSensor('areal_dual', 11, 14, (9.4e-3, 8.2e-3), (0.133, 0.091)),
    'air_cushion': MarkerSensor('air_cushion', 17, 17, (15.5e-3, 15.5e-3), rim_radius=0.150, height=0.120),
}

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The types of marker sensors, in one table: an entry, its parameter files and its launch file make a new type. No NumPy here: launch
reads it."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class MarkerSensorType:
    """A sheet or a dome with printed markers.

    rows, columns: of the printed grid; pitch: (2,) m along x and y; size: (2,) m of the clamped sheet, or rim_radius and height, m, of a
    dome; cameras: 1 or 2; full_force, full_torque: N and N m of the longest arrows in RViz; tip_radius: m, of the tool in most of the
    simulated scenes.
    """

    rows: int
    columns: int
    pitch: tuple[float, float]
    size: tuple[float, float] = (0.0, 0.0)
    rim_radius: float = 0.0
    height: float = 0.0
    cameras: int = 1
    full_force: float = 3.0
    full_torque: float = 0.05
    tip_radius: float = 0.006


#: Name -> type. Geometry as in the papers areal_single, areal_dual and air_cushion; arrows: twice the largest wrench of the simulated
#: scenes.
MARKER_SENSOR_TYPES = {
    'areal_single': MarkerSensorType(9, 13, (4.5e-3, 4.5e-3), (0.060, 0.045)),
    'areal_dual': MarkerSensorType(11, 14, (9.4e-3, 8.2e-3), (0.133, 0.091), cameras=2, full_force=2.0, tip_radius=0.008),
    'air_cushion': MarkerSensorType(17, 17, (15.5e-3, 15.5e-3), rim_radius=0.150, height=0.120, full_force=25.0, full_torque=0.7,
                                    tip_radius=0.030),
}

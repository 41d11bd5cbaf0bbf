# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Size of a sensor and of the arrows on it, read from its parameter file. Needs no ROS."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import yaml
from tactile_perception.common.spherical_cap import Cap

_TILTS = np.radians([0.0, 25.0, 50.0])  # rad from the pole, chosen: normals of a dome where arrows may stand


@dataclass(frozen=True)
class SensorShape:
    """half: half widths (2,) along x and y, m; height: over the frame's origin, m; reach: length of the arrows over the surface, m;
    radius: of curvature, m, 0 for a plane.
    """

    half: tuple[float, float]
    height: float
    reach: float
    radius: float = 0.0

    @property
    def width(self) -> float:
        """The larger width, m."""
        return 2 * max(self.half)

    def corners(self) -> np.ndarray:
        """Corners (8, 3), m, of the bounding box."""
        return np.array([(x * self.half[0], y * self.half[1], z) for x in (-1, 1) for y in (-1, 1) for z in (0.0, self.height)])

    def outermost(self) -> np.ndarray:
        """Points (N, 3), m, that the picture must contain: corners and arrow ends."""
        return np.vstack([self.corners(), self.arrow_ends()])

    def arrow_ends(self) -> np.ndarray:
        """Ends (N, 3), m, of the longest arrows on the surface."""
        if not self.radius:
            return self.corners()[1::2] + [0.0, 0.0, self.reach]
        tilt, turn = (part.ravel() for part in np.meshgrid(_TILTS, np.arange(8) * np.pi / 4))
        normals = np.column_stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        return [0.0, 0.0, self.height - self.radius] + (self.radius + self.reach) * normals


def shape_of(text: str) -> SensorShape:
    """Shape of the sensor that the text of a parameter file describes."""
    values = _values(yaml.safe_load(text))
    reach = values['normal_length'] + values.get('force_length', 0.0)
    if 'cap.height' in values:
        return _dome(Cap(values['cap.curvature_radius'], values['cap.height']), reach)
    if values.get('dome.height'):
        rim, height = values['dome.rim_radius'], values['dome.height']
        return _dome(Cap((rim**2 + height**2) / (2 * height), height), reach)
    if 'radius' in values:
        return SensorShape((values['radius'],) * 2, values['radius'], reach, values['radius'])
    if 'sheet_size' in values:
        return SensorShape(tuple(0.5 * side for side in values['sheet_size']), 0.0, reach)
    pitch = values['pitch']
    return SensorShape((0.5 * values['columns'] * pitch, 0.5 * values['rows'] * pitch), 0.0, reach)


def _dome(cap: Cap, reach: float) -> SensorShape:
    return SensorShape((cap.rim_radius,) * 2, cap.height, reach, cap.curvature_radius)


def _values(page: Mapping) -> dict:
    """Values by name: the parameters that all nodes share, and those of the markers node."""
    found: dict = {}
    for node, section in page.items():
        if node == '/**' or 'markers_node' in node:
            found.update(section['ros__parameters'])
    return found

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where untouched markers stand in space, from where they appear in the viewing plane, and how high a tip stands that just touches."""
from __future__ import annotations

import numpy as np

from ..surface.cap import Cap
from .sensor import MarkerSensor


def dome_cap(sensor: MarkerSensor) -> Cap:
    """The spherical cap over a dome's rim."""
    return Cap((sensor.rim_radius**2 + sensor.height**2) / (2 * sensor.height), sensor.height)


def rest_points(rest: np.ndarray, eye: np.ndarray, sensor: MarkerSensor) -> np.ndarray:
    """Places (K, 3) m of untouched markers that appear at rest (K, 2) m in the viewing plane to eyes (K, 3) m; NaN where not known."""
    appear = np.column_stack([rest, np.full(len(rest), sensor.plane_z)])
    if sensor.is_sheet:
        return appear
    rays = appear - eye
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    cap = dome_cap(sensor)
    offset = eye - [0.0, 0.0, cap.centre_z]
    along = np.sum(rays * offset, axis=1)
    inside = along**2 - np.sum(offset**2, axis=1) + cap.curvature_radius**2
    return eye + (np.sqrt(np.where(inside >= 0, inside, np.nan)) - along)[:, None] * rays


def first_touch_height(xy: np.ndarray, tip_radius: float, sensor: MarkerSensor) -> np.ndarray:
    """Heights (N,) m of a round tip's lowest point as it comes down at xy (N, 2) m and just touches; NaN beyond the dome."""
    xy = np.atleast_2d(xy)
    if sensor.is_sheet:
        return np.zeros(len(xy))
    cap = dome_cap(sensor)
    inside = (cap.curvature_radius + tip_radius)**2 - np.sum(xy**2, axis=1)
    return cap.centre_z + np.sqrt(np.where(inside >= 0, inside, np.nan)) - tip_radius

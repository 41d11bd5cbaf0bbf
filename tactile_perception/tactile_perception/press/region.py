# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact region of touches by round tips, from depth and tip radius (kernel touch_region: src/press/touch_region.cpp)."""
from __future__ import annotations

import numpy as np

from .. import _core
from ..common.estimates import ContactRegionEstimate
from .estimate import TouchEstimate
from .field import MarkerField
from .sensor import MarkerSensor


def region_of(touches: list[TouchEstimate], field: MarkerField, sensor: MarkerSensor, tip_radius: float) -> ContactRegionEstimate:
    """Contact region of a frame's touches; tip_radius: m, of tips whose radius the touch method does not estimate.

    The outlines are the circles where the skin leaves the tips, perpendicular to the untouched surface's normal there. A marker under a
    tip is sticking; slip is not estimated.
    """
    tips = np.array([[*(touch.position if touch.lowest is None else touch.lowest), touch.depth,
                      touch.radius if np.isfinite(touch.radius) else tip_radius] for touch in touches])
    known, state, discs, outlines = _core.touch_region(tips.reshape(-1, 5), field.rest, field.shift, field.eye, size=sensor.size,
                                                       rim_radius=sensor.rim_radius, height=sensor.height, plane=sensor.plane_z)
    estimate = ContactRegionEstimate(known, state)
    if not touches:
        return estimate
    areas, normals = np.pi * discs[:, 6]**2, discs[:, 3:6]
    estimate.outlines = list(outlines)
    estimate.area = float(areas.sum())
    estimate.centroid = areas @ discs[:, :3] / areas.sum()
    normal = areas @ normals
    estimate.normal = normal / np.linalg.norm(normal)
    estimate.major_axis = estimate.minor_axis = 2 * float(discs[0, 6]) if len(discs) == 1 else np.nan
    return estimate

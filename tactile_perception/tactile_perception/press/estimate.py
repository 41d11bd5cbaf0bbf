# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of one press, the interface of methods, and the contact region (kernel touch_region: src/press/touch_region.cpp)."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from .. import _core
from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, SATURATED, ContactRegionEstimate
from .field import MarkerField
from .sensor import MarkerSensor

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'SATURATED', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """One touch.

    position: (3,) m, sensor frame, of the object's lowest point (z = -depth on a sheet), of each of two the centre of its contact; depth:
    m, distance along z by which the object would have to be lifted to just touch the undeformed surface; covariance: (3, 3) m^2 of
    position; depth_sigma: m, standard deviation of depth; radius: m of the object's tip, NaN where the method does not estimate it;
    flags: OUT_OF_RANGE, AT_EDGE, AMBIGUOUS, SATURATED; reason: '' or the name of the fall-back method used; wrench: (6,) of the object on
    the sensor at the sensor frame's origin over the stiffness of the skin, m and m^2, NaN where the method does not estimate it; lowest:
    (3,) m, of the object's lowest point, None where it is position or not known.
    """

    position: np.ndarray
    depth: float
    covariance: np.ndarray
    depth_sigma: float
    radius: float = float('nan')
    flags: int = 0
    reason: str = ''
    wrench: np.ndarray = field(default_factory=partial(np.full, 6, np.nan))
    lowest: np.ndarray | None = None


class TouchMethod(Protocol):
    """A method, calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where nothing touches."""


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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of one press, the interface of methods, and the contact region."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, ContactRegionEstimate
from ..common.geometry import tangents
from .field import MarkerField
from .sensor import MarkerSensor, dome_cap

STEEPEST = 0.95    # largest contact radius over tip radius. Chosen: below a hemisphere's 1, where the slope is infinite
LEAST = 1e-9       # m, of a contact radius: a region has a centre
AT_CLAMP = 0.499   # of a side: places are no nearer to the clamp
RADII = np.geomspace(1e-4, 1.0, 1000)  # over the largest, between which contact radii are interpolated: to 1e-5
CORNERS = 36       # of an outline: the polygon has 0.5 % less area than the disc
AROUND = np.stack([np.cos(np.arange(CORNERS) * 2 * np.pi / CORNERS), np.sin(np.arange(CORNERS) * 2 * np.pi / CORNERS)], axis=1)

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """One touch.

    position: (3,) m, sensor frame, of the object's lowest point (z = -depth on a sheet), of each of two the centre of its contact; depth:
    m, distance along z by which the object would have to be lifted to just touch the undeformed surface; covariance: (3, 3) m^2 of
    position; depth_sigma: m, standard deviation of depth; radius: m of the object's tip, NaN where the method does not estimate it;
    flags: OUT_OF_RANGE, AT_EDGE, AMBIGUOUS; wrench: (6,) of the object on the sensor at the sensor frame's origin over the stiffness of the
    skin, m and m^2, NaN where the method does not estimate it; lowest: (3,) m, of the object's lowest point, None where it is position.
    """

    position: np.ndarray
    depth: float
    covariance: np.ndarray
    depth_sigma: float
    radius: float = float('nan')
    flags: int = 0
    wrench: np.ndarray = field(default_factory=partial(np.full, 6, np.nan))
    lowest: np.ndarray | None = None


class TouchMethod(Protocol):
    """A method, calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where nothing touches."""


def region_of(touches: list[TouchEstimate], field: MarkerField, sensor: MarkerSensor, tip_radius: float) -> ContactRegionEstimate:
    """Contact region of a frame's touches; tip_radius: m, of tips whose radius the touch method does not estimate.

    The outlines are the circles where the skin leaves the tips, perpendicular to the untouched surface's normal there. A marker that
    appears under a tip is sticking; slip is not estimated.
    """
    seen = np.flatnonzero(field.seen)
    now, camera_centre, under = (field.rest + field.shift)[seen], field.camera_centre[seen], np.zeros(len(seen), np.uint8)
    estimate = ContactRegionEstimate(seen, under)
    if not touches:
        return estimate
    discs = [_disc(touch, touch.radius if np.isfinite(touch.radius) else tip_radius, sensor) for touch in touches]
    for centre, _, radius in discs:
        share = (sensor.plane_z - camera_centre[:, 2:]) / (centre[2] - camera_centre[:, 2:])  # as the camera sees it in the viewing plane
        under |= np.hypot(*(now - camera_centre[:, :2] - share * (centre[:2] - camera_centre[:, :2])).T) <= radius
    centres, normals, radii = (np.array(part) for part in zip(*discs))
    areas = np.pi * radii**2
    estimate.outlines = [_circle(*disc) for disc in discs]
    estimate.area = float(areas.sum())
    estimate.centroid = areas @ centres / areas.sum()
    normal = areas @ normals
    estimate.normal = normal / np.linalg.norm(normal)
    estimate.major_axis = estimate.minor_axis = 2 * float(radii[0]) if len(discs) == 1 else np.nan
    return estimate


def _disc(touch: TouchEstimate, tip_radius: float, sensor: MarkerSensor) -> tuple[np.ndarray, np.ndarray, float]:
    """Centre (3,) and normal (3,) of the disc in which a tip of tip_radius, m, and the skin touch, and its radius, m."""
    lowest = touch.position if touch.lowest is None else touch.lowest
    bend = 0.0 if sensor.is_sheet else 1 / dome_cap(sensor).curvature_radius  # a convex skin leaves the tip sooner
    radius = _contact_radius(touch.depth, 1 / (1 / tip_radius + bend), _clearance(lowest[:2], sensor))
    normal = sensor.normal(lowest[:2] / (1 + tip_radius * bend))
    return lowest + [0.0, 0.0, tip_radius] - np.sqrt(max(tip_radius**2 - radius**2, 0.0)) * normal, normal, radius


def _contact_radius(depth: float, tip_radius: float, clearance: float) -> float:
    """Contact radius a, m, of a round tip on a taut membrane clamped at a distance of clearance, m. Within a the membrane follows the tip
    (a paraboloid, slope a / tip_radius at its edge); outside it solves Laplace's equation, so depth is logarithmic in the distance:
    depth = a^2 / tip_radius (1/2 + ln(clearance / a))."""
    radii = max(min(STEEPEST * tip_radius, clearance), LEAST) * RADII
    return float(np.interp(depth, radii**2 / tip_radius * (0.5 + np.log(max(clearance, LEAST) / radii)), radii))


def _clearance(place: np.ndarray, sensor: MarkerSensor) -> float:
    """Conformal radius, m, of the clamped area at a place (2,), m: radius of the circular membrane that is as compliant in its centre. A
    disc's is (R^2 - r^2) / R; a rectangle's is approximated from those of its two strips."""
    if not sensor.is_sheet:
        return max(sensor.rim_radius - place @ place / sensor.rim_radius, 0.0)
    size = np.array(sensor.size)
    return float(np.sum((2 * size / np.pi * np.cos(np.pi * np.clip(place / size, -AT_CLAMP, AT_CLAMP)))**-4.0)**-0.25)


def _circle(centre: np.ndarray, normal: np.ndarray, radius: float) -> np.ndarray:
    """(CORNERS, 3) m, around the disc."""
    return centre + radius * AROUND @ tangents(normal)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact region of touches by round tips, from depth and tip radius."""
from __future__ import annotations

from math import log

import numpy as np

from ...common.estimates import ContactRegionEstimate
from ...common.vectors import cross
from .touch import TouchEstimate
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor, dome_cap

STICKING = 1
_TURNS = np.linspace(0, 2 * np.pi, 36, endpoint=False)[:, None]  # corners of an outline: the polygon has 0.5 % less area than the disc
_STEEPEST = 0.95  # largest contact radius over tip radius; chosen, below a hemisphere's 1 where the slope is infinite
_HALVINGS = 30  # of the bracket: to 1e-9 of it


def contact_radius(depth: float, tip_radius: float, clearance: float) -> float:
    """Contact radius a, m, of a round tip of tip_radius, m, on a taut membrane clamped at a distance of clearance, m.

    Within a the membrane follows the tip (a paraboloid, slope a / tip_radius at its edge); outside it solves Laplace's equation, so depth
    is logarithmic in the distance: depth = a^2 / tip_radius (1/2 + ln(clearance / a)).
    """
    low, high = 0.0, float(min(_STEEPEST * tip_radius, clearance))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        deeper = middle**2 / tip_radius * (0.5 + log(clearance / middle))
        low, high = (middle, high) if deeper < depth else (low, middle)
    return 0.5 * (low + high)


def clearance(place: np.ndarray, sensor: MarkerSensor) -> float:
    """Conformal radius, m, of the clamped area at place (2,) m: radius of the circular membrane that is as compliant in its centre.

    A disc's is (R^2 - r^2) / R; a rectangle's is approximated from those of its two strips.
    """
    if not sensor.is_sheet:
        return float(max(sensor.rim_radius**2 - place @ place, 0.0) / sensor.rim_radius)
    size = np.asarray(sensor.size)
    strips = 2 * size / np.pi * np.cos(np.pi * np.clip(place / size, -0.499, 0.499))
    return float((strips**-4.0).sum()**-0.25)


def region_of(touches: list[TouchEstimate], field: MarkerField, sensor: MarkerSensor, tip_radius: float) -> ContactRegionEstimate:
    """Contact region of a frame's touches; tip_radius: m, of tips whose radius the touch method does not estimate.

    The outlines are the circles where the skin leaves the tips, perpendicular to the untouched surface's normal there. A marker under a
    tip is sticking; slip is not estimated.
    """
    known = np.flatnonzero(field.seen)
    state = np.zeros(len(known), np.uint8)
    estimate = ContactRegionEstimate(known, state)
    if not touches:
        return estimate
    now = field.rest[known] + field.shift[known]
    discs = [_disc(touch, sensor, tip_radius) for touch in touches]
    for centre, radius, _ in discs:
        seen_at = _appears(centre, field.eye[known], sensor.plane_z)
        state[np.hypot(*(now - seen_at).T) <= radius] = STICKING
    areas = np.array([np.pi * radius**2 for _, radius, _ in discs])
    estimate.outlines = [_circle(*disc) for disc in discs]
    estimate.area = float(areas.sum())
    estimate.centroid = areas @ np.array([centre for centre, _, _ in discs]) / areas.sum()
    normal = areas @ np.array([normal for _, _, normal in discs])
    estimate.normal = normal / np.linalg.norm(normal)
    estimate.major_axis = estimate.minor_axis = 2 * discs[0][1] if len(discs) == 1 else np.nan
    return estimate


def _disc(touch: TouchEstimate, sensor: MarkerSensor, tip_radius: float) -> tuple[np.ndarray, float, np.ndarray]:
    """Centre (3,) m and radius, m, of the contact disc, whose rim is where the skin leaves the tip; its normal (3,), outwards."""
    tip = touch.radius if np.isfinite(touch.radius) else tip_radius
    bend = 0.0 if sensor.is_sheet else 1 / dome_cap(sensor).curvature_radius  # a convex skin leaves the tip sooner
    radius = contact_radius(touch.depth, 1 / (1 / tip + bend), clearance(touch.position[:2], sensor))
    normal = sensor.normal(touch.position[:2] / (1 + tip * bend))
    return touch.position + [0.0, 0.0, tip] - np.sqrt(tip**2 - radius**2) * normal, radius, normal


def _appears(place: np.ndarray, eye: np.ndarray, plane_z: float) -> np.ndarray:
    """(N, 2) m: projection of place (3,) m from eyes (N, 3) m onto the viewing plane."""
    share = (plane_z - eye[:, 2]) / (place[2] - eye[:, 2])
    return eye[:, :2] + share[:, None] * (place[:2] - eye[:, :2])


def _circle(centre: np.ndarray, radius: float, normal: np.ndarray) -> np.ndarray:
    along = np.array([normal[2], 0.0, -normal[0]]) / np.hypot(normal[0], normal[2])
    return centre + radius * (np.cos(_TURNS) * along + np.sin(_TURNS) * cross(normal, along))

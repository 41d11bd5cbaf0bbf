# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where a marker of a dome appears: at the centroid of its outline as the camera sees it, bent and slanted."""
from __future__ import annotations

import numpy as np

from ...common.geometry import Cap
from ..view.sensor import MarkerSensor, dome_cap, rest_points

COUNT = 12      # points of an outline. Chosen: of 24, a centroid differs by less than a micrometre
#: Distance of the points over a disc's radius for which the polygon has the disc's second moment over its area; derived.
STRETCH = float(np.sqrt(3 / (2 + np.cos(2 * np.pi / COUNT))))
LEAST = 0.02    # of the mean: least area of a part of an outline. Chosen: a part that is seen from behind must not weigh negatively


def outlines(points: np.ndarray, marker: float, cap: Cap) -> np.ndarray:
    """(K, COUNT + 1, 3) m: points (K, 3), m, on a cap, and the outlines of discs of radius marker, m, around them, along the skin: polygons
    with the second moments of the discs."""
    centre = np.array([0.0, 0.0, cap.centre_z])
    up = (points - centre) / cap.curvature_radius
    along = np.stack([up[:, 2], np.zeros(len(up)), -up[:, 0]], axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = np.cross(up, along)
    turn, angle = np.arange(COUNT) * 2 * np.pi / COUNT, STRETCH * marker / cap.curvature_radius
    way = np.cos(turn)[:, None] * along[:, None] + np.sin(turn)[:, None] * across[:, None]
    round_it = centre + cap.curvature_radius * (np.cos(angle) * up[:, None] + np.sin(angle) * way)
    return np.concatenate([points[:, None], round_it], axis=1)


def appear_at(outline: np.ndarray, eyes: np.ndarray) -> np.ndarray:
    """(..., 2): tangents of the directions in which outlines (..., COUNT + 1, 3) appear from eyes (..., 3): their centroids."""
    offset = outline - eyes[..., None, :]
    seen = offset[..., :2] / offset[..., 2:]
    middle, first = seen[..., :1, :], seen[..., 1:, :]
    second = np.roll(first, -1, axis=-2)
    a, b = first - middle, second - middle
    area = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    area = area * np.sign(area.sum(axis=-1, keepdims=True))
    area = np.maximum(area, LEAST * np.abs(area).mean(axis=-1, keepdims=True) + 1e-30)
    return np.sum(area[..., None] * (middle + first + second), axis=-2) / (3 * area.sum(axis=-1)[..., None])


def centres_of(rest: np.ndarray, eyes: np.ndarray, marker: float, sensor: MarkerSensor) -> np.ndarray:
    """(K, 3) m: centres of the untouched markers of radius marker, m, that appear at rest (K, 2), m, in the viewing plane from eyes (K, 3),
    m; NaN where unknown."""
    points = rest_points(rest, eyes, sensor)
    for _ in range(2):  # each step leaves a twentieth
        appear = appear_at(outlines(points, marker, dome_cap(sensor)), eyes) * (sensor.plane_z - eyes[:, 2:]) + eyes[:, :2]
        off = points[:, :2] - eyes[:, :2]
        centre = off / (points[:, 2:] - eyes[:, 2:]) * (sensor.plane_z - eyes[:, 2:]) + eyes[:, :2]
        points = rest_points(rest + centre - appear, eyes, sensor)
    return points

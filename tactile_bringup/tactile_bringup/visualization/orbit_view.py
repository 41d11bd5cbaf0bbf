# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""RViz's Orbit view that shows a set of points. Needs no ROS."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FIELD_OF_VIEW = np.pi / 4  # rad, vertical: Ogre's default, which RViz does not change


@dataclass(frozen=True)
class OrbitView:
    """RViz's Orbit view: distance (m) from focal_point (m); yaw and pitch (rad) of the camera seen from there; z points up."""

    distance: float
    focal_point: tuple[float, float, float]
    yaw: float = 0.8
    pitch: float = 0.7

    def axes(self) -> np.ndarray:
        """Unit vectors as rows (3, 3): right and up in the picture, and towards the camera."""
        return _axes(self.yaw, self.pitch)

    def project(self, points: np.ndarray, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
        """Project points (N, 3), m, into a picture of size (width, height); positions (N, 2), px, and depths (N,), m, along the view."""
        turned = (points - np.array(self.focal_point)) @ self.axes().T
        depth = self.distance - turned[:, 2]
        scale = 0.5 * size[1] / (np.tan(0.5 * FIELD_OF_VIEW) * depth)
        return np.column_stack([0.5 * size[0] + scale * turned[:, 0], 0.5 * size[1] - scale * turned[:, 1]]), depth


def _axes(yaw: float, pitch: float) -> np.ndarray:
    towards = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def view_of(points: np.ndarray, size: tuple[int, int], filled: float = 0.9, yaw: float = 0.8, pitch: float = 0.7) -> OrbitView:
    """Closest view in which points (N, 3), m, stay within the share filled of a picture of size (width, height), px."""
    axes = _axes(yaw, pitch)
    right, up, back = (points @ axes.T).T
    slopes = filled * np.tan(0.5 * FIELD_OF_VIEW) * np.array([size[0] / size[1], 1.0])
    # A point is visible where |side - camera| <= slope * (camera's depth - depth). Its two inequalities bound the camera's position.
    bounds = [((side + slope * back).max(), (side - slope * back).min()) for side, slope in zip((right, up), slopes)]
    depth = max((high - low) / (2 * slope) for (high, low), slope in zip(bounds, slopes))
    distance = depth - 0.5 * (back.max() + back.min())
    camera = np.array([_centred(right, depth - back), _centred(up, depth - back), depth])
    focal = (camera - [0.0, 0.0, distance]) @ axes
    digits = 1 - int(np.floor(np.log10(distance))) + 2
    return OrbitView(round(float(distance), digits), tuple(round(float(x), digits + 1) for x in focal), yaw, pitch)


def _centred(side: np.ndarray, away: np.ndarray) -> float:
    """Camera position along one picture axis that centres the points: side (N,) along the axis, away (N,) the distance; by bisection."""
    low, high = float(side.min()), float(side.max())
    for _ in range(50):  # chosen: bisection reaches the resolution of a double
        middle = 0.5 * (low + high)
        seen = (side - middle) / away
        low, high = (middle, high) if seen.max() + seen.min() > 0 else (low, middle)
    return middle

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tools that touch a skin, as signed distance functions of points (..., 3), m, in the tool frame. All sizes are chosen.

The origin of the tool frame is the centre of the face, the middle of the ridge or the centre of the ball; z points away from the sensor.
"""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Callable

import numpy as np

from ...errors import BadArgument


def _extruded(outline: np.ndarray, z: np.ndarray, rounding: float) -> np.ndarray:
    """Signed distance (n,), m, of a prism above z = 0. outline: (n,) m, signed distance to its outline; rounding: rim radius, m."""
    side, front = outline + rounding, rounding - z
    return np.minimum(np.maximum(side, front), 0) + np.hypot(np.maximum(side, 0), np.maximum(front, 0)) - rounding


def block(p: np.ndarray, half_x: float = 0.0070, half_y: float = 0.0050, rounding: float = 0.0004) -> np.ndarray:
    """A rectangular face of 2 half_x by 2 half_y, m."""
    qx, qy = np.abs(p[..., 0]) - half_x, np.abs(p[..., 1]) - half_y
    outline = np.hypot(np.maximum(qx, 0), np.maximum(qy, 0)) + np.minimum(np.maximum(qx, qy), 0)
    return _extruded(outline, p[..., 2], rounding)


def disc(p: np.ndarray, radius: float = 0.0060, rounding: float = 0.0004) -> np.ndarray:
    """A circular face of radius, m."""
    return _extruded(np.hypot(p[..., 0], p[..., 1]) - radius, p[..., 2], rounding)


def ring(p: np.ndarray, inner: float = 0.0045, outer: float = 0.0075, rounding: float = 0.0005) -> np.ndarray:
    """An annular face between the radii inner and outer, m."""
    outline = np.abs(np.hypot(p[..., 0], p[..., 1]) - 0.5 * (inner + outer)) - 0.5 * (outer - inner)
    return _extruded(outline, p[..., 2], rounding)


def sphere(p: np.ndarray, radius: float = 0.0080) -> np.ndarray:
    """A ball of radius, m, around the origin."""
    return np.sqrt(p[..., 0]**2 + p[..., 1]**2 + p[..., 2]**2) - radius


def edge(p: np.ndarray, half_length: float = 0.0110, half_angle: float = 0.85, rounding: float = 0.0010) -> np.ndarray:
    """Edge of a prism along x. half_length: m; half_angle: rad, between flank and z; rounding: radius of the ridge, m."""
    # The axis of the rounded ridge is at z = rounding; the flank starts where it is tangent to the ridge.
    across, up = np.abs(p[..., 1]), p[..., 2] - rounding
    along_flank = across * np.sin(half_angle) + up * np.cos(half_angle)
    off_flank = across * np.cos(half_angle) - up * np.sin(half_angle)
    wedge = np.where(along_flank > 0, off_flank, np.hypot(across, up)) - rounding
    ends = np.abs(p[..., 0]) - half_length
    return np.minimum(np.maximum(wedge, ends), 0) + np.hypot(np.maximum(wedge, 0), np.maximum(ends, 0))


@dataclass(frozen=True)
class Tool:
    """One rigid object of one or more parts.

    parts: signed distance functions (..., 3) m -> (...) m; places: (3,) m, origin of each part in the tool frame; tip_radius: m, radius of
    parts that are balls (the least of them); None for faces and ridges. central: whether the contact position of each ball is the centroid
    of its region, as of faces and ridges, instead of its lowest point: one finger inclines the skin under the other, and they need not hold
    on to one object.
    """

    name: str
    parts: tuple[Callable, ...]
    places: tuple[tuple, ...] = ((0.0, 0.0, 0.0),)
    tip_radius: float | None = None
    central: bool = False

    def part_distances(self, p: np.ndarray) -> np.ndarray:
        """Signed distances (parts, ...), m, of points (..., 3), m, in the tool frame."""
        return np.stack([part(p - np.asarray(place)) for part, place in zip(self.parts, self.places)])

    def distance(self, p: np.ndarray) -> np.ndarray:
        """Signed distance (...), m, negative inside, of points (..., 3), m, in the tool frame."""
        return self.parts[0](p) if len(self.parts) == 1 else self.part_distances(p).min(axis=0)

    def distance_and_normal(self, p: np.ndarray, step: float = 2e-6) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), m, and its unit gradient (n, 3) at points (n, 3), m, by central differences of step, m."""
        shifts = np.concatenate([np.zeros((1, 3)), step * np.eye(3), -step * np.eye(3)])
        values = self.distance(p + shifts[:, None, :])
        slope = (values[1:4] - values[4:7]).T
        return values[0], slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-300)


def _balls(name: str, radius: float, *places: tuple) -> Tool:
    """One ball of radius, m, or several with centres at places (3,), m."""
    places = places or ((0.0, 0.0, 0.0),)
    return Tool(name, (partial(sphere, radius=radius),) * len(places), places, radius)


def _pair(name: str, radius: float, apart: float) -> Tool:
    """Two balls of radius, m, with centres apart, m, along x."""
    return replace(_balls(name, radius, (-apart / 2, 0.0, 0.0), (apart / 2, 0.0, 0.0)), central=True)


def _fingers(name: str, radii: tuple[float, float], apart: float) -> Tool:
    """Two balls of radii, m, whose lowest points are at one height and apart, m, along x."""
    parts = tuple(partial(sphere, radius=radius) for radius in radii)
    return Tool(name, parts, tuple((x, 0.0, radius) for x, radius in zip((-apart / 2, apart / 2), radii)), min(radii), central=True)


TOOLS = {tool.name: tool for tool in (
    Tool('rectangle', (block,)),
    Tool('disc', (disc,)),
    Tool('ring', (ring,)),
    _balls('sphere', 0.0080),
    Tool('prism', (edge,)),
    _balls('two_spheres', 0.0045, (-0.0065, 0.0, 0.0), (0.0065, 0.0, 0.0004)),
    *(_balls(f'ball_{mm}mm', mm * 1e-3) for mm in (5, 6, 7.5, 8, 10, 15, 22, 30, 42, 60)),
    *(_pair(f'fingertips_{mm}mm', 0.0050, mm * 1e-3) for mm in (11, 14, 18, 23, 28, 33, 37, 46)),
    *(_fingers(f'fingers_4_and_9mm_{mm}mm', (0.004, 0.009), mm * 1e-3) for mm in (20, 26)),
    *(_fingers(f'fingers_6_and_12mm_{mm}mm', (0.006, 0.012), mm * 1e-3) for mm in (30, 42)),
    *(_pair(f'fists_{mm}mm', 0.0150, mm * 1e-3) for mm in (42, 56, 70)),
)}


def tool_named(name: str) -> Tool:
    """The tool of that name. Raises BadArgument, listing the names, for an unknown one."""
    if name not in TOOLS:
        raise BadArgument(f'simulation: tool {name!r} is unknown; choose one of {", ".join(sorted(TOOLS))}')
    return TOOLS[name]

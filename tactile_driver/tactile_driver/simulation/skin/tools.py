# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tools that touch a skin, as signed distance functions of points (..., 3), m, in the tool frame; their motions."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Callable

import numpy as np

from .surfaces import Skin

# The origin of the tool frame is the centre of the face, the middle of the ridge or the centre of the ball; z points away from the sensor.


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


@dataclass(frozen=True)
class Tool:
    """One rigid object of one or more parts.

    parts: signed distance functions (..., 3) m -> (...) m; positions: (3,) m, origin of each part in the tool frame; tip_radius: m,
    smallest radius of parts that are balls; None for faces and ridges. central: whether the contact position of each ball is the centroid
    of its region, as of faces and ridges, instead of its lowest point: one finger inclines the skin under the other, and they need not hold
    one object. plate: (2,) m, half size of a plate that covers all markers of a sheet and holds them; None for other tools.
    """

    name: str
    parts: tuple[Callable, ...]
    positions: tuple[tuple, ...] = ((0.0, 0.0, 0.0),)
    tip_radius: float | None = None
    central: bool = False
    plate: tuple[float, float] | None = None

    def part_distances(self, p: np.ndarray) -> np.ndarray:
        """Signed distances (parts, ...), m, of points (..., 3), m, in the tool frame."""
        return np.stack([part(p - np.asarray(position)) for part, position in zip(self.parts, self.positions)])

    def distance(self, p: np.ndarray) -> np.ndarray:
        """Signed distance (...), m, negative inside, of points (..., 3), m, in the tool frame."""
        return self.parts[0](p) if len(self.parts) == 1 else self.part_distances(p).min(axis=0)

    def distance_and_normal(self, p: np.ndarray, step: float = 2e-6) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,), m, and its unit gradient (n, 3) at points (n, 3), m, by central differences of step, m."""
        shifts = np.concatenate([np.zeros((1, 3)), step * np.eye(3), -step * np.eye(3)])
        values = self.distance(p + shifts[:, None, :])
        slope = (values[1:4] - values[4:7]).T
        return values[0], slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-300)


def _balls(name: str, *balls: tuple[float, tuple], central: bool = False) -> Tool:
    """One ball or several. balls: radius, m, and position (3,), m, of its centre; central: see Tool."""
    radii, positions = zip(*balls)
    return Tool(name, tuple(partial(sphere, radius=radius) for radius in radii), positions, min(radii), central)


def _pair(name: str, radii: tuple[float, float], apart_mm: float, level: bool = True) -> Tool:
    """Two balls of radii, m, apart along x, with their centres at one height, or (level: false) their lowest points."""
    positions = ((side * 0.5e-3 * apart_mm, 0.0, 0.0 if level else radius) for side, radius in zip((-1, 1), radii))
    return _balls(f'{name}_{apart_mm}mm', *zip(radii, positions), central=True)


TOOLS = {tool.name: tool for tool in (
    Tool('rectangle', (block,)),
    Tool('disc', (disc,)),
    Tool('ring', (ring,)),
    _balls('sphere', (0.0080, (0.0, 0.0, 0.0))),
    _balls('two_spheres', (0.0045, (-0.0065, 0.0, 0.0)), (0.0045, (0.0065, 0.0, 0.0004))),
    *(_balls(f'ball_{mm}mm', (mm * 1e-3, (0.0, 0.0, 0.0))) for mm in (5, 6, 7.5, 8, 10, 15, 22, 30, 42, 60)),
    *(_pair('fingertips', (0.0050, 0.0050), mm) for mm in (11, 14, 18, 23, 28, 37, 46)),
    *(_pair('fists', (0.0150, 0.0150), mm) for mm in (42, 56, 70)),
    *(_pair('fingers_4_and_9mm', (0.004, 0.009), mm, False) for mm in (20, 26)),
    *(_pair('fingers_6_and_12mm', (0.006, 0.012), mm, False) for mm in (30, 42)),
    *(Tool(f'plate_{2e3 * x:.0f}x{2e3 * y:.0f}mm', (partial(block, half_x=x, half_y=y, rounding=0.0),), plate=(x, y))
      for x, y in ((0.0285, 0.0195), (0.0635, 0.0435))),
)}


@dataclass(frozen=True)
class Key:
    """Pose of the tool at time t, s. x, y: m; press: m, below the height of first contact (negative: above the skin); yaw about z, roll
    about x, pitch about y: rad, applied in the order roll, pitch, yaw. other_x, other_y, other_press: m, displacement of the part of the
    tool at x > 0, which is an object of its own, and how much deeper it is pressed."""

    t: float
    x: float = 0.0
    y: float = 0.0
    press: float = -0.003
    yaw: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    other_x: float = 0.0
    other_y: float = 0.0
    other_press: float = 0.0


def attitude(yaw: float, roll: float, pitch: float) -> np.ndarray:
    """Rotation matrix (3, 3) from the tool frame to the sensor frame: roll about x, then pitch about y, then yaw about z, rad."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


@dataclass(frozen=True)
class Pose:
    """Pose of the tool. origin: (3,) m; turn: (3, 3) rotation; x_sensor = origin + turn @ x_tool; other: (3,) m, what is added to x_sensor
    for the part of the tool at x_tool > 0, which moves by itself."""

    origin: np.ndarray
    turn: np.ndarray
    other: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def to_tool(self, xyz: np.ndarray) -> np.ndarray:
        """Points (..., 3), m, from the sensor frame to the tool frame; those of the other part by its own motion."""
        p = (xyz - self.origin) @ self.turn
        return np.where(p[..., :1] > 0, p - self.other @ self.turn, p) if self.other.any() else p

    def to_sensor(self, p: np.ndarray) -> np.ndarray:
        """Points (..., 3), m, from the tool frame to the sensor frame."""
        return p @ self.turn.T + self.origin + (p[..., :1] > 0) * self.other


class Motion:
    """Path of a tool over a skin. keys: two or more, in order of time; the tool is present from the first to the last."""

    def __init__(self, tool: Tool, keys: list[Key], skin: Skin):
        self.tool = tool
        self.times = np.array([key.t for key in keys])
        rows = []
        for key in keys:
            turn = attitude(key.yaw, key.roll, key.pitch)
            height = skin.touching_height(tool.distance, turn, key.x, key.y) - key.press
            rows.append([key.x, key.y, height, key.yaw, key.roll, key.pitch, key.other_x, key.other_y, -key.other_press])
        self._rows = np.array(rows)

    def covers(self, t: float) -> bool:
        """Whether the tool is present at time t, s."""
        return bool(self.times[0] <= t <= self.times[-1])

    def pose(self, t: float) -> Pose:
        """Pose of the tool at time t, s; it accelerates and decelerates at each key."""
        k = int(np.clip(np.searchsorted(self.times, t, side='right') - 1, 0, len(self.times) - 2))
        part = np.clip((t - self.times[k]) / (self.times[k + 1] - self.times[k]), 0, 1)
        # Trapezoidal velocity profile of a stage: 15 % of the time each to accelerate and to decelerate.
        ramp = 0.15
        near = min(part, 1 - part)
        share = (min(near, ramp)**2 / (2 * ramp) + max(near - ramp, 0)) / (1 - ramp)
        row = self._rows[k] + (share if part < 0.5 else 1 - share) * (self._rows[k + 1] - self._rows[k])
        return Pose(row[:3], attitude(*row[3:6]), row[6:])

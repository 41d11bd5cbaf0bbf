# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Motions of tools: poses interpolated between keys; depths are relative to first contact with the resting skin."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .grid import Skin
from .tools import Tool


@dataclass(frozen=True)
class Key:
    """Pose of the tool at time t, s. x, y: m; press: m, below the height of first contact (negative: above the skin); yaw about z, roll
    about x, pitch about y: rad, applied in the order roll, pitch, yaw. other_x, other_y, other_press: m, how far the part of the tool at
    x > 0 has moved from its place, and how much deeper it is pressed: an object of its own."""

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
    (cy, sy), (cr, sr), (cp, sp) = ((np.cos(a), np.sin(a)) for a in (yaw, roll, pitch))
    turn_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1.0]])
    turn_y = np.array([[cp, 0, sp], [0, 1.0, 0], [-sp, 0, cp]])
    turn_x = np.array([[1.0, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return turn_z @ turn_y @ turn_x


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
        # Trapezoidal velocity profile of a stage: 15 % of the time each to accelerate and to decelerate; chosen.
        ramp = 0.15
        if part < ramp:
            share = part**2 / (2 * ramp)
        elif part > 1 - ramp:
            share = 1 - ramp - (1 - part)**2 / (2 * ramp)
        else:
            share = part - ramp / 2
        row = self._rows[k] + (share / (1 - ramp)) * (self._rows[k + 1] - self._rows[k])
        return Pose(row[:3], attitude(*row[3:6]), row[6:])

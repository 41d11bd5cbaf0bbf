# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a probe presses in a guided calibration: a sheet or a dome along z, a finger along its normals."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_driver.errors import BadArgument
from tactile_perception.bags.replay import read_sensor_type
from tactile_perception.common.marker_sensor import MarkerSensor, first_touch_height
from tactile_perception.core.sensor_type import SENSOR_TYPES


@dataclass(frozen=True)
class Rules:
    """What a press has to be, for a hand-held tool, far above the noise of stages and arms. Lengths in m, times in s."""

    untouched_s: float = 1.0  # without contact before a press
    still_s: float = 0.4  # at one depth
    still_radius: float = 5e-5  # within which a tip at rest moves
    touch_depth: float = 1e-4  # a shallower press is none, as for calibrate
    depth_step: float = 3e-4  # between two depths
    stuck_s: float = 1.0  # without another value of the wrench: the force sensor is saturated, or has stopped
    max_slide: float = 4e-4  # over the surface
    max_speed: float = 0.5  # m/s, of a probe that touches; a faster one has jumped
    frames: int = 3  # messages that are kept of each depth
    rest_frames: int = 8  # messages that are kept from before the press
    keeps_all: bool = False  # all messages of a press are kept instead


class MarkedSurface:
    """A sheet or a dome, pressed along z by a round tip.

    tip_radius: m; a sheet does not need it. Raises BadArgument for a dome without it.
    """

    rules = Rules()

    def __init__(self, sensor: MarkerSensor, tip_radius: float):
        if not sensor.is_sheet and not tip_radius > 0:
            raise BadArgument(f'calibrate_node: tip_radius is {tip_radius}; on a curved surface the depth of a press depends on the '
                              "radius of the probe's round tip: set it, in m")
        self._sensor, self._tip_radius = sensor, tip_radius
        self.size = np.array(sensor.size if sensor.is_sheet else [2 * sensor.rim_radius] * 2)
        # On a sheet as far out as a fingertip fits, on a dome as far as it can be pressed along z.
        self.positions = _grid(0.74 * self.size) if sensor.is_sheet else _disc(12, 0.5 * sensor.rim_radius)

    def depth(self, tip: np.ndarray) -> float:
        """m, of a tip (3,) m; NaN beside a dome."""
        return float(first_touch_height(tip[:2], self._tip_radius, self._sensor)[0] - tip[2])

    def holds(self, tip: np.ndarray) -> bool:
        """Whether a tip (3,) m is over the surface."""
        if self._sensor.is_sheet:
            return bool((np.abs(tip[:2]) <= self.size / 2).all())
        return bool(np.hypot(*tip[:2]) <= self._sensor.rim_radius)

    def contact(self, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) m and direction (3,) of the press, outwards."""
        return tip, np.array([0.0, 0.0, 1.0])


class Fingertip:
    """A hemisphere, pressed towards its centre. Calibration uses the rise of its light, so every message of a press is kept."""

    rules = Rules(untouched_s=0.4, still_s=0.15, still_radius=2e-5, keeps_all=True)

    def __init__(self, radius: float):
        self.radius, self.size = radius, np.full(2, 2 * radius)
        tilt = _disc(60, np.radians(70))  # as far out as its light reaches
        self.positions = radius * np.sinc(np.linalg.norm(tilt, axis=1) / np.pi)[:, None] * tilt

    def depth(self, tip: np.ndarray) -> float:
        """m, of a tip (3,) m; NaN under the rim."""
        return float(self.radius - np.linalg.norm(tip)) if tip[2] > 0 else float('nan')

    def holds(self, tip: np.ndarray) -> bool:
        """Whether a tip (3,) m is over the surface."""
        return bool(tip[2] > 0)

    def contact(self, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (3,) m, on the sphere, and direction (3,) of the press, outwards."""
        normal = tip / np.linalg.norm(tip)
        return self.radius * normal, normal


def surface_of(params: Path, tip_radius: float) -> MarkedSurface | Fingertip:
    """The surface of the sensor of a parameter file, whose type has one. Raises BadArgument for wrong parameters."""
    pressed = SENSOR_TYPES[read_sensor_type(params)].read_pressed_surface(params)
    return MarkedSurface(pressed, tip_radius) if isinstance(pressed, MarkerSensor) else Fingertip(pressed)


def _grid(span: np.ndarray) -> np.ndarray:
    """(12, 2) m: 4 x 3 positions over span (x, y), m."""
    x, y = (np.linspace(-0.5, 0.5, count) * length for length, count in zip(span, (4, 3)))
    return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


def _disc(count: int, radius: float) -> np.ndarray:
    """(count, 2) m: positions spread evenly over a disc of a radius, m, on a spiral of the golden angle."""
    number = np.arange(count)
    distance, angle = radius * np.sqrt(number / count), number * np.pi * (3 - np.sqrt(5))
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])

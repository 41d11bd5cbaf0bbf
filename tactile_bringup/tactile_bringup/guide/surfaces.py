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
from tactile_perception.sensor_type import SENSOR_TYPES


@dataclass(frozen=True)
class Rules:
    """What a press has to be. All lengths in m, times in s; chosen for a hand-held tool, far above the noise of stages and arms.

    whole: all that comes while it is pressed is kept, else `frames` messages of each depth and `rest` before the press.
    """

    untouched: float = 1.0
    still: float = 0.4
    noise: float = 5e-5  # of the tip's position while it is held still
    touching: float = 1e-4  # as calibrate, to which a shallower press is none
    step: float = 3e-4  # between two depths
    stuck: float = 1.0  # without another value of the wrench: it is saturated, or has stopped
    slid: float = 4e-4
    fastest: float = 0.5  # m/s; what moves faster while it touches has jumped
    frames: int = 3
    rest: int = 8
    whole: bool = False


class MarkedSurface:
    """A sheet or a dome, pressed along z by a round tip of tip_radius, m, which a sheet does not need. Raises BadArgument for a dome
    without it."""

    rules = Rules()

    def __init__(self, sensor: MarkerSensor, tip_radius: float):
        if not sensor.is_sheet and not tip_radius > 0:
            raise BadArgument(f'calibrate_node: tip_radius is {tip_radius}; on a curved surface the depth of a press needs the radius of '
                              "the probe's round tip, m")
        self._sensor, self._tip_radius = sensor, tip_radius
        self.size = np.array(sensor.size if sensor.is_sheet else [2 * sensor.rim_radius] * 2)
        # A sheet as far out as a fingertip fits, a dome as far as it can be pressed along z.
        self.places = _grid(0.74 * self.size) if sensor.is_sheet else _disc(12, 0.5 * sensor.rim_radius)

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
    """A hemisphere, pressed towards its centre. Its light is fast and is wanted as it rises, so every message of a press is kept."""

    rules = Rules(untouched=0.4, still=0.15, noise=2e-5, whole=True)

    def __init__(self, radius: float):
        self.radius, self.size = radius, np.full(2, 2 * radius)
        tilt = _disc(60, np.radians(70))  # as far out as its light reaches
        self.places = radius * np.sinc(np.linalg.norm(tilt, axis=1) / np.pi)[:, None] * tilt

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
    """(12, 2) m: 4 x 3 places over span (x, y), m."""
    x, y = (np.linspace(-0.5, 0.5, count) * length for length, count in zip(span, (4, 3)))
    return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)


def _disc(count: int, reach: float) -> np.ndarray:
    """(count, 2) m: places spread evenly over a disc of radius reach, m, on a spiral of the golden angle."""
    number = np.arange(count)
    way, angle = reach * np.sqrt(number / count), number * np.pi * (3 - np.sqrt(5))
    return np.column_stack([way * np.cos(angle), way * np.sin(angle)])

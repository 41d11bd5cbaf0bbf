# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which frames of a demo are worth a picture. No ROS here."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .summary import Reading

_WORTH = 1.05  # a frame replaces a picture only where it shows so much more


def _slipping(reading: Reading) -> float:
    return reading.states[2] if len(reading.states) == 3 and reading.slip not in ('', 'no slip') else 0.0


#: name -> what makes a frame the one to show: the frame with the most of it, if there is any.
MOMENTS: dict[str, Callable[[Reading], float]] = {
    'largest_displacement': lambda reading: reading.displacement if reading.displacement > 1.0 else 0.0,
    'largest_contact': lambda reading: reading.area,
    'deepest_contact': lambda reading: reading.depth,
    'most_slip': _slipping,
}


@dataclass
class Picture:
    """A frame that is kept: value, by which it was chosen; stamp_s; image (H, W, 3) uint8 BGR."""

    value: float
    stamp_s: float
    image: np.ndarray


class Moments:
    """Keeps the best frame for each moment, and the first and last of all."""

    def __init__(self):
        self.kept: dict[str, Picture] = {}

    def add(self, reading: Reading, image: np.ndarray) -> None:
        """Take one frame with its annotated image (H, W, 3) uint8, which must not change any more."""
        for name, value_of in MOMENTS.items():
            value = float(value_of(reading))
            if math.isfinite(value) and value > 0 and (name not in self.kept or value > _WORTH * self.kept[name].value):
                self.kept[name] = Picture(value, reading.stamp_s, image)
        if 'first' not in self.kept:
            self.kept['first'] = Picture(0.0, reading.stamp_s, image)
        self.kept['last'] = Picture(0.0, reading.stamp_s, image)

    def pictures(self) -> dict[str, Picture]:
        """Name -> picture, each frame once, in the order of time."""
        found: dict[float, str] = {}
        for name, picture in self.kept.items():
            found.setdefault(picture.stamp_s, name)
        return {name: self.kept[name] for _, name in sorted(found.items())}

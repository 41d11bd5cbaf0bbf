# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Selects the frames of a demo that are saved as pictures. No ROS here."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .summary import Reading

_GAIN = 1.05  # chosen: a frame replaces a picture only if its value is 5 % larger, which spares most copies while a value grows


def _slipping(reading: Reading) -> float:
    return reading.states[2] if len(reading.states) == 3 and reading.slip not in ('', 'no slip') else 0.0


#: Name of the picture -> value of a frame; the frame with the largest value above 0 is kept.
MOMENTS: dict[str, Callable[[Reading], float]] = {
    'largest_displacement': lambda reading: reading.displacement if reading.displacement > 1.0 else 0.0,
    'largest_contact': lambda reading: reading.area,
    'deepest_contact': lambda reading: reading.depth,
    'most_slip': _slipping,
}


@dataclass
class Picture:
    """A frame that is kept. value: that it was selected by; stamp_s: of exposure; image: (H, W, 3) uint8 BGR."""

    value: float
    stamp_s: float
    image: np.ndarray


class Moments:
    """Keeps the frame with the largest value of each of MOMENTS, and the first and the last frame."""

    def __init__(self):
        self.kept: dict[str, Picture] = {}

    def add(self, reading: Reading, image: np.ndarray) -> None:
        """Add one frame with its annotated image (H, W, 3) uint8; the image is kept, not copied."""
        for name, value_of in MOMENTS.items():
            value = float(value_of(reading))
            if math.isfinite(value) and value > 0 and (name not in self.kept or value > _GAIN * self.kept[name].value):
                self.kept[name] = Picture(value, reading.stamp_s, image)
        if 'first' not in self.kept:
            self.kept['first'] = Picture(0.0, reading.stamp_s, image)
        self.kept['last'] = Picture(0.0, reading.stamp_s, image)

    def pictures(self) -> dict[str, Picture]:
        """Name -> picture in the order of time; a frame kept under several names appears once."""
        found: dict[float, str] = {}
        for name, picture in self.kept.items():
            found.setdefault(picture.stamp_s, name)
        return {name: self.kept[name] for _, name in sorted(found.items())}

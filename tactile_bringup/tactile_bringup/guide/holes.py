# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses by hand through the holes of a guide plate, for those without a robot: the hole is told by its number, the depth by the tool's
collar, and the time by the sensor's own signal."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from tactile_driver.errors import BadArgument

from .mounting import Touches
from .session import Press, Sample
from .surfaces import MarkedSurface

_PLATEAU = 0.97  # of the largest signal, from which the collar is at the plate. Chosen: a press by hand goes through the last 3 % at once
_UNKNOWN = np.full(6, np.nan)


class Holes(Touches):
    """Judges samples in their order, as Session does. holes: (N, 2) m, in the order in which they are pressed; collars: m, depths to which
    the tool goes in: all holes with the first, then with the next; signal: see Touches. Raises BadArgument for holes beside the surface."""

    def __init__(self, surface: MarkedSurface, holes: np.ndarray, collars: Sequence[float], signal: Callable[[object], np.ndarray]):
        super().__init__(surface, signal, lambda *_: np.full(2, np.nan))
        self.places, self._depths, self._count = np.tile(holes, (len(collars), 1)), np.repeat(collars, len(holes)), len(holes)
        outside = [f'{1e3 * x:g} {1e3 * y:g}' for x, y in holes if not surface.holds(np.array([x, y, 0.0]))]
        if outside or not len(holes) or not len(collars) or min(collars) <= self.rules.touching:
            raise BadArgument(f'calibrate_node: holes at {", ".join(outside) or "no"} mm are outside the surface, or collars '
                              f'{list(collars)} are none; give x and y of each hole, m, and depths above {self.rules.touching:g} m')

    @property
    def advice(self) -> str:
        """What to press next."""
        if not self.open_places:
            return 'all holes are pressed'
        number = self.open_places[0]
        return (f'hole {number % self._count + 1}, collar {1e3 * self._depths[number]:g} mm: touch nothing for '
                f'{2 * self.rules.untouched:g} s, press to the collar, hold still for a second, and lift')

    def _judged(self, quiet: list[tuple[Sample, np.ndarray]], pressed: list[tuple[Sample, np.ndarray]],
                base: np.ndarray) -> tuple[Press | None, str]:
        size = np.array([np.linalg.norm(signal - base.mean(0)) for _, signal in pressed])
        held = [sample for (sample, _), part in zip(pressed, size / size.max()) if part > _PLATEAU]
        if held[-1].stamp_s - held[0].stamp_s < self.rules.still or len(held) < self.rules.frames:
            return None, f'dropped: the tool was not held at its collar for {self.rules.still:g} s'
        number = self.open_places[0]
        x, y = self.places[number]
        tip = np.array([x, y, self.surface.depth(np.array([x, y, 0.0])) - self._depths[number]])
        middle = len(held) // 2 - self.rules.frames // 2
        rest = [quiet[k][0] for k in np.unique(np.linspace(0, len(base) - 1, self.rules.rest).astype(int))]
        press = Press([replace(sample, wrench=_UNKNOWN) for sample in rest], holds=[tip])
        press.touched = [replace(sample, tip=tip, wrench=_UNKNOWN) for sample in held[middle:middle + self.rules.frames]]
        return press, f'taken: {1e3 * self._depths[number]:g} mm deep'

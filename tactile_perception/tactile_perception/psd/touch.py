# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact or none, sample by sample: an object is near, and the light is what it is when the waveguide is touched."""
from __future__ import annotations

import numpy as np

from .lamps import LampWatch, Seen, held

_LEAST_LEVEL, _HALF = 4.0, 1.5  # standard deviations: of the light at touch at the least; hysteresis to either side


class TouchDecision:
    """Contact with hysteresis; touching: whether the last sample was in contact."""

    def __init__(self):
        self._lamps = LampWatch()
        self.begin()

    def begin(self) -> None:
        """Nothing touches."""
        self.touching = False
        self._lamps.begin()

    def process(self, total: np.ndarray, level: np.ndarray | None, sigma: float, period_s: float) -> tuple[np.ndarray, Seen]:
        """(contact (M,), what was seen) for totals (N,), V, of samples period_s apart.

        level: (N,) V at which the waveguide is touched where the light is; None where not known: then whatever is near touches.
        """
        seen = self._lamps.process(total, sigma, period_s)
        contact = seen.near
        if level is not None and contact.any():
            over = total[:len(contact)] - np.maximum(level[:len(contact)], _LEAST_LEVEL * sigma)
            if not (self.touching and over.min() >= -_HALF * sigma and contact.all()):  # else it goes on
                contact = contact & held((over > _HALF * sigma) & contact, (over < -_HALF * sigma) | ~contact, self.touching)
        self.touching = bool(contact[-1])
        return contact, seen

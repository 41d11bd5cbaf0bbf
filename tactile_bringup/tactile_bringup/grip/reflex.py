# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The grip reflex as a function of what is felt: hold, close on slip, let go when nothing touches."""
from __future__ import annotations

from dataclasses import dataclass

LONGEST_S = 0.1  # of an interval that counts: after a gap nobody knows whether the object slipped all the while


@dataclass(frozen=True)
class Reflex:
    """hold: N, at the first touch; most: N; closing: N/s, while the object slips."""

    hold: float = 1.0
    most: float = 10.0
    closing: float = 20.0

    def next_force(self, force: float, touched: bool, slips: bool, interval: float) -> float:
        """The grip force, N, after force, N, was commanded interval s ago (negative or NaN: not known, and counts as none)."""
        if not touched:
            return 0.0
        force = max(force, self.hold)
        if not slips:
            return force
        return min(force + self.closing * (min(interval, LONGEST_S) if interval > 0 else 0.0), self.most)

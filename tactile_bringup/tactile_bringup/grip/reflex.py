# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Grip reflex: hold an object on contact, close while it slips, release when nothing touches."""
from __future__ import annotations

from dataclasses import dataclass

LONGEST_S = 0.1  # chosen: longest interval that counts, since nobody knows whether the object slipped throughout a gap in the data


@dataclass(frozen=True)
class Reflex:
    """hold: force at the first touch, N; most: largest force, N; closing: rate of closing while the object slips, N/s."""

    hold: float = 1.0
    most: float = 10.0
    closing: float = 20.0

    def next_force(self, force: float, touched: bool, slips: bool, interval: float) -> float:
        """Next grip force, N; force, N, was commanded interval s ago. A negative or NaN interval is unknown and counts as 0."""
        if not touched:
            return 0.0
        force = max(force, self.hold)
        if not slips:
            return force
        return min(force + self.closing * (min(interval, LONGEST_S) if interval > 0 else 0.0), self.most)

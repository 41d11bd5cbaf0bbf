# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimates or ground truth of one stamp."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate


@dataclass
class Instant:
    """contacts, region, slip as in the messages; wrench: (6,) N and N m. None without a message."""

    contacts: list[ContactEstimate] | None = None
    region: ContactRegionEstimate | None = None
    slip: SlipEstimate | None = None
    wrench: np.ndarray | None = None

    @property
    def touched(self) -> bool | None:
        """Whether anything touches; None when unknown."""
        if self.contacts is not None:
            return bool(self.contacts)
        return None if self.region is None else self.region.area > 0

    @property
    def place(self) -> np.ndarray:
        """Position (2,), m, of the first contact, otherwise of the region's centroid; NaN when unknown."""
        places = [c.position[:2] for c in self.contacts or []] + ([self.region.centroid[:2]] if self.region is not None else [])
        return next((place for place in places if np.isfinite(place).all()), np.full(2, np.nan))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of one instant, as it was told or as it is."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate


@dataclass
class Instant:
    """contacts, region, slip as the messages have them; wrench: (6,) N and N m. None where nothing was said of it at all."""

    contacts: list[ContactEstimate] | None = None
    region: ContactRegionEstimate | None = None
    slip: SlipEstimate | None = None
    wrench: np.ndarray | None = None

    @property
    def touched(self) -> bool | None:
        """Whether anything touches; None where that is not said."""
        if self.contacts is not None:
            return bool(self.contacts)
        return None if self.region is None else self.region.area > 0

    @property
    def place(self) -> np.ndarray:
        """(2,) m, x and y of the first touch, else of the region's centroid; NaN where neither is known."""
        places = [c.position[:2] for c in self.contacts or []] + ([self.region.centroid[:2]] if self.region is not None else [])
        return next((place for place in places if np.isfinite(place).all()), np.full(2, np.nan))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The same contact from frame to frame: regions of dots or taxels and the contacts that they continue (src/common/contact_tracker.cpp)."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._core import common as _kernel
from .surface import Moments

may_continue = _kernel.may_continue


class ContactTracker:
    """Contacts of regions from frame to frame."""

    def __init__(self):
        self._tracker = _kernel.ContactTracker()

    def reset(self) -> None:
        """All regions are new contacts; ids are not reused."""
        self._tracker.reset()

    def assign(self, labels: np.ndarray, regions: Sequence[tuple[int, Moments]], reach: float,
               stamp_s: float) -> list[_kernel.TrackedContact]:
        """The contact of each region, a label and moments, in their order. labels: of each dot or taxel, 0 outside of the regions; reach:
        m; stamp_s: s."""
        return self._tracker.assign(labels.astype(np.int32).ravel(), list(regions), reach, stamp_s)

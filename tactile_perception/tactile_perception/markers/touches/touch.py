# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a touch method says of one frame."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, SATURATED
from ..view.marker_field import MarkerField

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'SATURATED', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """One touch.

    position: (3,) m, sensor frame, where the object's foremost point stands (z = -depth on a sheet); depth: m, how far the object would
    have to go back along z to just touch the untouched surface; covariance: (3, 3) m^2 of position; depth_sigma: m; radius: m of the
    object's tip, NaN where not told; flags: of OUT_OF_RANGE, AT_EDGE, AMBIGUOUS, SATURATED; reason: '' or the name of the fall-back used.
    """

    position: np.ndarray
    depth: float
    covariance: np.ndarray
    depth_sigma: float
    radius: float = float('nan')
    flags: int = 0
    reason: str = ''


class TouchMethod(Protocol):
    """A method, calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where nothing touches."""

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of one touch, and the interface of touch methods."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import numpy as np

from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, SATURATED
from .field import MarkerField

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'SATURATED', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """One touch.

    position: (3,) m, sensor frame, of the object's lowest point (z = -depth on a sheet), of each of two the centre of its contact; depth:
    m, distance along z by which the object would have to be lifted to just touch the undeformed surface; covariance: (3, 3) m^2 of
    position; depth_sigma: m, standard deviation of depth; radius: m of the object's tip, NaN where the method does not estimate it;
    flags: OUT_OF_RANGE, AT_EDGE, AMBIGUOUS, SATURATED; reason: '' or the name of the fall-back method used; wrench: (6,) of the object on
    the sensor at the sensor frame's origin over the stiffness of the skin, m and m^2, NaN where the method does not estimate it; lowest:
    (3,) m, of the object's lowest point, None where it is position or not known.
    """

    position: np.ndarray
    depth: float
    covariance: np.ndarray
    depth_sigma: float
    radius: float = float('nan')
    flags: int = 0
    reason: str = ''
    wrench: np.ndarray = field(default_factory=partial(np.full, 6, np.nan))
    lowest: np.ndarray | None = None


class TouchMethod(Protocol):
    """A method, calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where nothing touches."""

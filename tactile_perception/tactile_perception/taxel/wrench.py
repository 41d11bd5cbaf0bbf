# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The object that two fingers grasp. Its wrench on a finger: src/taxel/estimator.cpp."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class GraspedObject:
    """The object between two fingers; NaN for unknown quantities.

    Attributes
    ----------
    depth : float
        Indentation of the pad in m, half of the object's width minus the gap between the fingers; negative without contact.
    weight : ndarray, shape (3,)
        Weight in N in the sensor frame, of which each finger holds half.
    centre_of_mass : ndarray, shape (3,)
        Centre of mass in m in the sensor frame.
    can_roll : bool
        Whether the object can roll over the pad; parallel fingers prevent it.
    """

    depth: float = np.nan
    weight: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    centre_of_mass: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    can_roll: bool = True

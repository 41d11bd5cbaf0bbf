# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of the membrane in one frame."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MembraneState:
    """The membrane in one frame: all K dots of the grid in the order of their numbers, unseen ones interpolated.

    xyz: (K, 3) m, sensor frame; ranges: (K,) m from the camera's centre; touched: (K,) probability that the dot carries a load;
    fluid_pressure: Pa; seen: (K,) bool.
    """

    xyz: np.ndarray
    ranges: np.ndarray
    touched: np.ndarray
    fluid_pressure: float
    seen: np.ndarray

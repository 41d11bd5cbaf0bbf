# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants that the simulated presses of sheets and of domes share."""
from __future__ import annotations

import numpy as np

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # points of the two-point Gauss rule on [-1, 1]
DEPTH_POWER = 1.5  # grading of the depths, which are denser at first contact
DEPTH_MARGIN = 1.15  # simulated depth over the deepest calibrated press
MAX_RELATIVE_DEPTH = 1.02  # over the calibrated depth; deeper presses are out of range

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Constants that the simulated presses of sheets and of domes share."""
from __future__ import annotations

import numpy as np

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # points of the two-point Gauss rule on [-1, 1]

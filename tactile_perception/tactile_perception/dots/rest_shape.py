# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Whether a reference looks untouched: a printed grid at rest is smooth, a pressed one has a dent or a bulge somewhere."""
from __future__ import annotations

import numpy as np


def rest_suspicion(id: np.ndarray, uv: np.ndarray, columns: int) -> str:
    """A reason to doubt that dots id (N,) at uv (N, 2) px on a grid of so many columns are untouched; empty if there is none."""
    return ''

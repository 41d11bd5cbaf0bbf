# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Subpixel positions of worn discs: robust fit of a soft-edged disc on sloping ground
(kernel fit_worn_discs: src/dots/detect/worn_disc.cpp)."""
from __future__ import annotations

import numpy as np
from tactile_perception._core import fit_worn_discs

from ...common.dots import Dots
from .disc_correlation import RING, SIZE, shrunk


def fit_discs(grey: np.ndarray, sign: int, uv: np.ndarray, diameter: float) -> Dots:
    """Dots of an image (H, W) uint8, fitted from positions uv (N, 2) px of discs of about that diameter, px; sign: 1 for bright, -1 for
    dark."""
    small, scale = shrunk(grey, min(1.0, SIZE / diameter))
    size = float(scale.mean())
    u, v, radius, sigma = fit_worn_discs(small * np.float32(sign), (uv + 0.5) * scale - 0.5, radius=diameter * size / 2, ring=RING).T
    return Dots((np.stack([u, v], axis=1) + 0.5) / scale - 0.5, np.pi * (radius / size)**2, sigma / size)

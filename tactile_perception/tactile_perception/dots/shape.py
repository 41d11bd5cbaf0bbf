# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The image of one printed dot: a disc seen through the blur of optics and pixels, by its profile along a radius."""
from __future__ import annotations

import numpy as np

_REACH = 6.0  # standard deviations after which a Gaussian is taken to have ended
_STEPS = 241
_PIXEL_VARIANCE = 1.0 / 12.0  # a square pixel's, px^2


def _normal_integral() -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and the standard normal distribution function there; NumPy has no error function of its own."""
    t = np.linspace(-_REACH, _REACH, 4801)
    density = np.exp(-0.5 * t**2)
    total = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    return t, total / total[-1]


_T, _NORMAL = _normal_integral()


def blurred_disc(radius: np.ndarray, diameter: float, blur: float) -> np.ndarray:
    """Brightness of a disc of brightness one at these distances from its centre.

    radius: any shape, px; diameter, blur (standard deviation of the optics' blur, without the pixel's own): px. The disc is cut into strips across the direction
    looked along; each strip's share is a difference of normal integrals, so that the sum is exact but for the number of strips.
    """
    s = np.sqrt(blur**2 + _PIXEL_VARIANCE)
    half = diameter / 2
    angle = (np.arange(_STEPS) + 0.5) / _STEPS * np.pi - np.pi / 2
    along, share = half * np.sin(angle), half * np.cos(angle) * np.pi / _STEPS
    chord = 2 * np.interp(half * np.cos(angle) / s, _T, _NORMAL) - 1
    grid = np.linspace(0, np.max(radius) + 1e-9, 8 + int(np.max(radius) * 16))
    density = np.exp(-0.5 * ((grid[:, None] - along) / s) ** 2) / (s * np.sqrt(2 * np.pi))
    return np.interp(radius, grid, density @ (share * chord))

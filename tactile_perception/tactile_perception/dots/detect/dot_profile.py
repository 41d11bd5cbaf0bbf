# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The image of one printed dot: a disc seen through the blur of optics and pixels, by its profile along a radius."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_REACH = 6.0  # standard deviations after which a Gaussian is taken to have ended
_STRIPS = 181
_PER_PIXEL = 24  # samples of a profile a pixel
_PIXEL_VARIANCE = 1.0 / 12.0  # a square pixel's, px^2
_DIFFERENCE = 0.02  # px, for derivatives


def _normal_integral() -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and the standard normal distribution function there; NumPy has no error function of its own."""
    t = np.linspace(-_REACH, _REACH, 4801)
    density = np.exp(-0.5 * t**2)
    total = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    return t, total / total[-1]


_T, _NORMAL = _normal_integral()


def blurred_disc(radius: np.ndarray, diameter: float, blur: float) -> np.ndarray:
    """Brightness of a disc of brightness one at these distances (any shape, px) from its centre.

    diameter, blur (standard deviation of the optics' blur, without the pixel's own): px. The disc is cut into strips across the direction
    looked along; each
    strip's share is a difference of normal integrals, so that the sum is exact but for the number of strips.
    """
    grid = np.arange(int(np.max(radius) * _PER_PIXEL) + 2) / _PER_PIXEL
    return np.interp(radius, grid, _profile(grid, diameter, blur))


def _profile(radius, diameter, blur):
    s = np.sqrt(blur**2 + _PIXEL_VARIANCE)
    half = diameter / 2
    angle = (np.arange(_STRIPS) + 0.5) / _STRIPS * np.pi - np.pi / 2
    along, share = half * np.sin(angle), half * np.cos(angle) * np.pi / _STRIPS
    chord = 2 * np.interp(half * np.cos(angle) / s, _T, _NORMAL) - 1
    density = np.exp(-0.5 * ((radius[:, None] - along) / s) ** 2) / (s * np.sqrt(2 * np.pi))
    return density @ (share * chord)


@dataclass
class DiscModes:
    """How the image of a disc changes with its place, size, blur and ovalness, per unit of each, at pixels x, y from its centre (any
    shape)."""

    shape: np.ndarray
    by_u: np.ndarray
    by_v: np.ndarray
    by_diameter: np.ndarray
    by_blur: np.ndarray
    oval: np.ndarray
    oval_oblique: np.ndarray


def disc_modes(x: np.ndarray, y: np.ndarray, diameter: float, blur: float) -> DiscModes:
    """The image of a disc and its derivatives at pixels x, y (same shape, px) from its centre."""
    radius = np.hypot(x, y)
    grid = np.arange(int(radius.max() * _PER_PIXEL) + 2) / _PER_PIXEL
    h = _DIFFERENCE
    middle = _profile(grid, diameter, blur)
    by_diameter = (_profile(grid, diameter + h, blur) - _profile(grid, diameter - h, blur)) / (2 * h)
    by_blur = (_profile(grid, diameter, blur + h) - _profile(grid, diameter, max(blur - h, 0.0))) / (2 * h)
    inverse = 1 / np.maximum(radius, 1e-6)
    outward = np.interp(radius, grid, np.gradient(middle, 1 / _PER_PIXEL)) * inverse
    edge = np.interp(radius, grid, by_diameter)
    turn = edge * inverse**2
    return DiscModes(np.interp(radius, grid, middle), -outward * x, -outward * y, edge, np.interp(radius, grid, by_blur),
        turn * (x * x - y * y), 2 * turn * x * y)

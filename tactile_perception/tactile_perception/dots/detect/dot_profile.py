# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Image model of one printed dot: a disc blurred by optics and pixels, as a radial profile."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_REACH = 6.0  # standard deviations at which a Gaussian is truncated: 1e-9 lies beyond
# Strips over which a disc is integrated: so many, and so many per radius over blur. The sum over a half circle of angles converges
# exponentially; with these it is within 1e-7 of the brightness for discs of 1.5 to 30 px and any blur (measured).
_STRIPS, _STRIPS_PER_BLUR = 6, 3.2
_PER_PIXEL = 24  # samples of a profile per pixel. Chosen
_PIXEL_VARIANCE = 1.0 / 12.0  # px^2, of a square pixel
_DIFFERENCE = 0.02  # px, step of numerical derivatives. Chosen


def _normal_integral() -> tuple[np.ndarray, np.ndarray]:
    """Abscissae and the standard normal cumulative distribution there (NumPy has no error function)."""
    t = np.linspace(-_REACH, _REACH, 4801)
    density = np.exp(-0.5 * t**2)
    total = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    return t, total / total[-1]


_T, _NORMAL = _normal_integral()


def blurred_disc(radius: np.ndarray, diameter: float, blur: float) -> np.ndarray:
    """Radial profile of a blurred disc of unit brightness, at distances radius (any shape, px) from its centre.

    diameter: px; blur: px, standard deviation of the optics without the pixel. The disc is integrated over strips, each a difference of
    normal distribution functions, which is exact up to the number of strips.
    """
    grid = np.arange(int(np.max(radius) * _PER_PIXEL) + 2) / _PER_PIXEL
    return np.interp(radius, grid, _profile(grid, diameter, blur))


def _profile(radius, diameter, blur):
    s = np.sqrt(blur**2 + _PIXEL_VARIANCE)
    half = diameter / 2
    strips = _STRIPS + int(_STRIPS_PER_BLUR * half / s)
    angle = (np.arange(strips) + 0.5) / strips * np.pi - np.pi / 2
    along, share = half * np.sin(angle), half * np.cos(angle) * np.pi / strips
    chord = 2 * np.interp(half * np.cos(angle) / s, _T, _NORMAL) - 1
    near = radius[radius < half + _REACH * s]  # radius ascends
    exponent = (near[:, None] - along) / s
    exponent *= exponent
    exponent *= -0.5
    density = np.exp(exponent, out=exponent)
    return np.concatenate([density @ (share * chord / (s * np.sqrt(2 * np.pi))), np.zeros(len(radius) - len(near))])


@dataclass
class DiscModes:
    """Image of a disc and its derivatives by position, diameter, blur and two components of ellipticity (any shape)."""

    shape: np.ndarray
    by_u: np.ndarray
    by_v: np.ndarray
    by_diameter: np.ndarray
    by_blur: np.ndarray
    oval: np.ndarray
    oval_oblique: np.ndarray


def disc_modes(x: np.ndarray, y: np.ndarray, diameter: float, blur: float) -> DiscModes:
    """The image of a disc and its derivatives at offsets x, y (same shape, px) from its centre; diameter, blur: px."""
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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential displacement and traction of the pad's surface, and the pressure under the pad that traction causes.

A bristle model (the paper's virtual cantilevers) with coupled neighbours: each surface element is held by the pad's shear stiffness and its
neighbours, and follows the object up to friction times pressure. Coupling makes the rim of a contact slip first. Pressure rises where
traction converges, so the pressure image leads an object that drags the pad.
"""
from __future__ import annotations

import math

import cv2
import numpy as np

from .array import SoftPad, TaxelArray

# Pressure under a bonded elastic layer by traction on it, relative to a thin layer (thickness times divergence of traction), as a function
# of wave number times thickness. Derived from linear elasticity for Poisson ratios of 0.3 to 0.49, which hardly matter, and fitted within
# 0.03 by two Gaussians: share, width over thickness.
_SPREADS = ((0.47, 0.62), (0.53, 1.85))

# Attenuation of a pressure wave by the pad: this times (wave number times thickness) squared. Derived by the same theory.
_FLATTENED = 0.15
_SHARPENED = 0.5  # thicknesses, width of the Gaussian of the unsharp mask that undoes it. Chosen
# Coupling of neighbours: stiffness of a surface wave grows by this times (wave number times thickness) squared. Derived by the same theory:
# about the mean of waves along (0.8) and across (0.3).
_COUPLED = 0.5
_SWEEPS = 3  # relaxation sweeps a frame, continued in the next one. Chosen
_TINY = np.float32(1e-12)  # m
_WIDE = 2.0  # taxels, width from which two box filters replace a Gaussian. Chosen
# The border of the pressure image leads by this many thicknesses times traction over pressure. Derived by the same theory.
BORDER_LEAD = 0.5


class SurfaceShear:
    """State of the pad's surface; dragged: whether there is any traction."""

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._array, self._pad = array, pad
        self._blurs = [_Blur(share, width * pad.thickness / array.pitch) for share, width in _SPREADS]
        thickness = pad.thickness / array.pitch
        self._width = _SHARPENED * thickness
        self._coupling, self._margin = _COUPLED * thickness**2, max(1, round(thickness))
        self._x, self._y = array.x.astype(np.float32)[None, :], array.y.astype(np.float32)[:, None]
        self.reset()

    def reset(self) -> None:
        """Release all traction."""
        self._drag = np.zeros((2, *self._array.shape), np.float32)
        self._pull = np.zeros_like(self._drag)
        self.dragged = False

    def traction_pressure(self) -> np.ndarray | None:
        """(rows, columns) Pa, the part of the pressure under the pad that traction causes; None without traction."""
        if not self.dragged:
            return None
        along, across = self._pull
        change = np.zeros(self._array.shape, np.float32)
        change[:, 1:-1] = along[:, :-2] - along[:, 2:]
        change[1:-1] += across[:-2] - across[2:]
        change *= np.float32(0.5 * self._pad.shear_stiffness * self._pad.thickness / self._array.pitch)
        return sum(blur.apply(change) for blur in self._blurs)

    @property
    def force(self) -> np.ndarray:
        """(2,) N that the object exerts along the surface."""
        return self._pull.sum(axis=(1, 2), dtype=float) * self._pad.shear_stiffness * self._array.taxel_area

    def move(self, touched: np.ndarray, pressure: np.ndarray, shift: np.ndarray, turn: float) -> np.ndarray:
        """Slip (2, rows, columns) m of an object that moves by shift (2,) m at the origin and turn, rad, over the surface.

        touched: (rows, columns) bool, in contact; pressure: (rows, columns) Pa.
        """
        box = self._around(touched)
        part = (slice(None), *box)
        here, carried = touched[box].astype(np.float32), self._drag[part].copy()
        carried[0] += (np.float32(shift[0]) - np.float32(turn) * self._y[box[0]]) * here
        carried[1] += (np.float32(shift[1]) + np.float32(turn) * self._x[:, box[1]]) * here
        limit = np.maximum(self._on_top(pressure[box]), 0) * np.float32(self._pad.friction / self._pad.shear_stiffness) * here
        drag, pull = self._balanced(carried, limit)
        self._drag, self._pull, slip = np.zeros((3, 2, *self._array.shape), np.float32)
        self._drag[part], self._pull[part], slip[part] = drag, pull, (carried - drag) * here
        self.dragged = True
        return slip

    def _around(self, touched: np.ndarray) -> tuple[slice, slice]:
        """Rows and columns of the contact with a margin of one thickness."""
        left, top, width, height = cv2.boundingRect(touched.view(np.uint8))
        margin = self._margin
        return slice(max(top - margin, 0), top + height + margin), slice(max(left - margin, 0), left + width + margin)

    def _balanced(self, carried: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement of the surface and traction over shear stiffness, both (2, rows, columns) m, by relaxation.

        carried: (2, rows, columns) m, displacement without slip; limit: (rows, columns) m, of the traction, 0 outside the contact.
        """
        coupling, stiff = np.float32(self._coupling), np.float32(1 + 4 * self._coupling)
        held, soft = stiff * carried, 1 / stiff
        wide = np.stack([cv2.copyMakeBorder(part, 1, 1, 1, 1, cv2.BORDER_REPLICATE) for part in carried])
        drag = wide[:, 1:-1, 1:-1]
        for _ in range(_SWEEPS):
            others = wide[:, :-2, 1:-1] + wide[:, 2:, 1:-1]
            others += wide[:, 1:-1, :-2]
            others += wide[:, 1:-1, 2:]
            others *= coupling
            pull = held - others
            square = pull * pull
            pull *= np.minimum(limit / (np.sqrt(square[0] + square[1]) + _TINY), 1)
            np.multiply(pull + others, soft, out=drag)
        return drag, pull

    def _on_top(self, pressure: np.ndarray) -> np.ndarray:
        """Pressure on the pad's surface from the smoother one under it; second order in thickness over wavelength."""
        smoother = cv2.GaussianBlur(pressure, (0, 0), self._width, borderType=cv2.BORDER_REPLICATE)
        return pressure + np.float32(2 * _FLATTENED / _SHARPENED**2) * (pressure - smoother)


class _Blur:
    """Gaussian blur of that width, taxels, times share; two box filters approximate a wide one."""

    def __init__(self, share: float, width: float):
        self._share, self._boxes = np.float32(share), ()
        if width < _WIDE:
            self._kernel = cv2.getGaussianKernel(2 * math.ceil(4 * width) + 1, width, cv2.CV_32F)
        else:
            side = 2 * round(0.5 * (math.sqrt(6 * width**2 + 1) - 1)) + 1
            self._boxes = (side, side), (side, side)

    def apply(self, image: np.ndarray) -> np.ndarray:
        """image (rows, columns) float32, blurred."""
        image = image * self._share
        if not self._boxes:
            return cv2.sepFilter2D(image, -1, self._kernel, self._kernel, borderType=cv2.BORDER_CONSTANT)
        for box in self._boxes:
            image = cv2.boxFilter(image, -1, box, borderType=cv2.BORDER_CONSTANT)
        return image

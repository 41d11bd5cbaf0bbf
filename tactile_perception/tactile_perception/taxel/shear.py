# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the object does along the pad's surface: how far it drags each place of the pad, and what that does to the picture under it.

The surface above each taxel is held by the pad's shear stiffness and by its neighbours, and follows the object up to friction times
pressure: a bristle, as the paper's virtual cantilevers, but with neighbours, for which a contact's rim is pulled most and slips first.
Traction on the surface is balanced by pressure under the pad: it rises where traction converges, so that the picture runs ahead of an
object that drags the pad.
"""
from __future__ import annotations

import math

import cv2
import numpy as np

from .array import SoftPad, TaxelArray

# Pressure under a bonded layer from traction on it, over the thin layer's (thickness times divergence of the traction), by wave number
# times thickness, for Poisson ratios of 0.3 to 0.49, which hardly matter: two Gaussians (share, width over thickness) fitted within 0.03.
_SPREADS = ((0.47, 0.62), (0.53, 1.85))

# A wave of pressure is weaker under the pad by this times the square of (wave number times thickness).
_FLATTENED = 0.15
_SHARPENED = 0.5  # thicknesses: width of the Gaussian whose loss is given back for that
# Neighbouring places pull at each other: a wave of the surface is stiffer by this times the square of (wave number times thickness); mean
# of the waves along (0.8) and across (0.3), by the same theory.
_COUPLED = 0.5
_SWEEPS = 3
_TINY = np.float32(1e-12)  # m
_WIDE = 2.0  # taxels
# The border of a picture is ahead by this many thicknesses for each part of the pressure that traction is, by the same theory.
LEAD = 0.5


class SurfaceShear:
    """Frame by frame; dragged: whether there is any."""

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._array, self._pad = array, pad
        self._spreads = [_Spread(share, width * pad.thickness / array.pitch) for share, width in _SPREADS]
        thickness = pad.thickness / array.pitch
        self._width = _SHARPENED * thickness
        self._coupling, self._margin = _COUPLED * thickness**2, max(1, round(thickness))
        self._x, self._y = array.x.astype(np.float32)[None, :], array.y.astype(np.float32)[:, None]
        self.reset()

    def reset(self) -> None:
        """Nothing is dragged."""
        self._drag = np.zeros((2, *self._array.shape), np.float32)
        self._pull = np.zeros_like(self._drag)
        self.dragged = False

    def leading(self) -> np.ndarray | None:
        """(rows, columns) Pa by which the pressure under the pad is changed by traction; None where there is none."""
        if not self.dragged:
            return None
        along, across = self._pull
        change = np.zeros(self._array.shape, np.float32)
        change[:, 1:-1] = along[:, :-2] - along[:, 2:]
        change[1:-1] += across[:-2] - across[2:]
        change *= np.float32(0.5 * self._pad.shear_stiffness * self._pad.thickness / self._array.pitch)
        return sum(spread.of(change) for spread in self._spreads)

    @property
    def force(self) -> np.ndarray:
        """(2,) N that the object exerts along the surface."""
        return self._pull.sum(axis=(1, 2), dtype=float) * self._pad.shear_stiffness * self._array.taxel_area

    def move(self, touched: np.ndarray, pressure: np.ndarray, velocity: np.ndarray, turn: float) -> np.ndarray:
        """Carry the surface along, in the taxels touched (rows, columns) bool under pressure (rows, columns) Pa; the object moves by
        velocity (2,) m at the origin and turn, rad. (2, rows, columns) m, by which it slips over the surface there."""
        box = self._around(touched)
        part = (slice(None), *box)
        here, carried = touched[box].astype(np.float32), self._drag[part].copy()
        carried[0] += (np.float32(velocity[0]) - np.float32(turn) * self._y[box[0]]) * here
        carried[1] += (np.float32(velocity[1]) + np.float32(turn) * self._x[:, box[1]]) * here
        limit = np.maximum(self._on_top(pressure[box]), 0) * np.float32(self._pad.friction / self._pad.shear_stiffness) * here
        drag, pull = self._balanced(carried, limit)
        self._drag, self._pull, slip = np.zeros((3, 2, *self._array.shape), np.float32)
        self._drag[part], self._pull[part], slip[part] = drag, pull, (carried - drag) * here
        self.dragged = True
        return slip

    def _around(self, touched: np.ndarray) -> tuple[slice, slice]:
        """The part of the array that the contact drags."""
        left, top, width, height = cv2.boundingRect(touched.view(np.uint8))
        margin = self._margin
        return slice(max(top - margin, 0), top + height + margin), slice(max(left - margin, 0), left + width + margin)

    def _balanced(self, carried: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (2, rows, columns) m of the surface, and traction over the shear stiffness, m: it goes with the object unless the traction
        would be over limit, which is 0 where nothing touches. A few steps of relaxation, which go on in the next frame."""
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
        """Pressure on the pad's surface from that under it, which is smoother; to second order in thickness over wave length."""
        smoother = cv2.GaussianBlur(pressure, (0, 0), self._width, borderType=cv2.BORDER_REPLICATE)
        return pressure + np.float32(2 * _FLATTENED / _SHARPENED**2) * (pressure - smoother)


class _Spread:
    """Pictures spread as by a Gaussian of that width, taxels, times share; two boxes do for a wide one."""

    def __init__(self, share: float, width: float):
        self._share, self._boxes = np.float32(share), ()
        if width < _WIDE:
            self._kernel = cv2.getGaussianKernel(2 * math.ceil(4 * width) + 1, width, cv2.CV_32F)
        else:
            side = 2 * round(0.5 * (math.sqrt(6 * width**2 + 1) - 1)) + 1
            self._boxes = (side, side), (side, side)

    def of(self, picture: np.ndarray) -> np.ndarray:
        """picture (rows, columns) float32, spread."""
        picture = picture * self._share
        if not self._boxes:
            return cv2.sepFilter2D(picture, -1, self._kernel, self._kernel, borderType=cv2.BORDER_CONSTANT)
        for box in self._boxes:
            picture = cv2.boxFilter(picture, -1, box, borderType=cv2.BORDER_CONSTANT)
        return picture

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the object does along the pad's surface: how far it drags each place of the pad, and what that does to the picture under it.

The surface above each taxel is held by the pad's shear stiffness and by its neighbours, and follows the object up to friction times
pressure: a bristle, as the paper's virtual cantilevers, but with neighbours, for which a contact's rim is pulled most and slips first.
Traction on the surface is balanced by pressure under the pad: it rises where traction converges, so that the picture runs ahead of an
object that drags the pad.
"""
from __future__ import annotations

import cv2
import numpy as np

from .array import SoftPad, TaxelArray

# Pressure under a bonded layer from traction on it, over the thin layer's (thickness times divergence of the traction), by wave number
# times thickness, for Poisson ratios of 0.3 to 0.49, which hardly matter: two Gaussians (share, width over thickness) fitted within 0.03.
_SPREADS = ((0.47, 0.62), (0.53, 1.85))

# A wave of pressure is weaker under the pad by this times the square of (wave number times thickness).
_FLATTENED = 0.15
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
        self._gaps = [(share, width * pad.thickness / array.pitch) for share, width in _SPREADS]
        thickness = pad.thickness / array.pitch
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
        (share, width), (other_share, other_width) = self._gaps
        return np.float32(share) * _spread(change, width) + np.float32(other_share) * _spread(change, other_width)

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
        held, wide = stiff * carried, np.empty((2, carried.shape[1] + 2, carried.shape[2] + 2), np.float32)
        drag = wide[:, 1:-1, 1:-1]
        drag[:] = carried
        for _ in range(_SWEEPS):
            others = _neighbours(wide)
            others *= coupling
            pull = held - others
            square = pull * pull
            pull *= np.minimum(limit / (np.sqrt(square[0] + square[1]) + _TINY), 1)
            np.divide(pull + others, stiff, out=drag)
        return drag, pull

    def _on_top(self, pressure: np.ndarray) -> np.ndarray:
        """Pressure on the pad's surface from that under it, which is smoother; to second order in thickness over wave length."""
        share = _FLATTENED * (self._pad.thickness / self._array.pitch)**2
        around = _neighbours(cv2.copyMakeBorder(pressure, 1, 1, 1, 1, cv2.BORDER_REPLICATE)[None])[0]
        return pressure * np.float32(1 + 4 * share) - around * np.float32(share)


def _neighbours(wide: np.ndarray) -> np.ndarray:
    """Sum of the four neighbours (N, rows, columns) in wide (N, rows + 2, columns + 2), whose border is made as what is beside it."""
    wide[:, 0], wide[:, -1] = wide[:, 1], wide[:, -2]
    wide[:, :, 0], wide[:, :, -1] = wide[:, :, 1], wide[:, :, -2]
    total = wide[:, :-2, 1:-1] + wide[:, 2:, 1:-1]
    total += wide[:, 1:-1, :-2]
    total += wide[:, 1:-1, 2:]
    return total


def _spread(values: np.ndarray, width: float) -> np.ndarray:
    """values (rows, columns) spread as by a Gaussian; two boxes do for a wide one."""
    if width < _WIDE:
        return cv2.GaussianBlur(values, (0, 0), width, borderType=cv2.BORDER_CONSTANT)
    side = 2 * round(0.5 * (np.sqrt(6 * width**2 + 1) - 1)) + 1
    once = cv2.boxFilter(values, -1, (side, side), borderType=cv2.BORDER_CONSTANT)
    return cv2.boxFilter(once, -1, (side, side), borderType=cv2.BORDER_CONSTANT)

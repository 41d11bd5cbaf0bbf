# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tangential displacement and traction of the pad's surface, and the pressure under the pad that traction causes.

A bristle model (the paper's virtual cantilevers) with coupled neighbours: each surface element is held by the pad's shear stiffness and its
neighbours, and follows the object up to friction times pressure. Coupling makes the rim of a contact slip first. Pressure rises where
traction converges, so the pressure image leads an object that drags the pad.
"""
from __future__ import annotations

import numpy as np

from .._core import taxel_move, taxel_pull_pressure
from .array import SoftPad, TaxelArray

# Pressure under a bonded elastic layer by traction on it, relative to a thin layer (thickness times divergence of traction), as a function
# of wave number times thickness. Derived from linear elasticity for Poisson ratios of 0.3 to 0.49, which hardly matter, and fitted within
# 0.03 by two Gaussians: share, width over thickness.
SPREADS = ((0.47, 0.62), (0.53, 1.85))

# Attenuation of a pressure wave by the pad: this times (wave number times thickness) squared. Derived by the same theory.
FLATTENED = 0.15
_SHARPENED = 0.5  # thicknesses, width of the Gaussian of the unsharp mask that undoes it. Chosen
# Coupling of neighbours: stiffness of a surface wave grows by this times (wave number times thickness) squared. Derived by the same theory:
# about the mean of waves along (0.8) and across (0.3).
_COUPLED = 0.5
# The border of the pressure image leads by this many thicknesses times traction over pressure. Derived by the same theory.
BORDER_LEAD = 0.5


class SurfaceShear:
    """State of the pad's surface; dragged: whether there is any traction."""

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._array, self._pad = array, pad
        thickness = pad.thickness / array.pitch
        self._spreads = np.array([(share, width * thickness) for share, width in SPREADS])
        self._rule = {'pitch': array.pitch, 'thickness': thickness, 'coupling': _COUPLED * thickness**2,
                      'on_top': 2 * FLATTENED / _SHARPENED**2, 'sharp': _SHARPENED * thickness}
        self.reset()

    def reset(self) -> None:
        """Release all traction."""
        self._drag = np.zeros((2, *self._array.shape), np.float32)
        self._pull, self._pulled = np.zeros_like(self._drag), np.zeros(2)
        self.friction = self._pad.friction
        self.dragged = False

    def traction_pressure(self) -> np.ndarray | None:
        """(rows, columns) Pa, the part of the pressure under the pad that traction causes; None without traction."""
        if not self.dragged:
            return None
        return taxel_pull_pressure(self._pull, gain=0.5 * self._pad.shear_stiffness * self._pad.thickness / self._array.pitch,
                                   spreads=self._spreads)

    @property
    def force(self) -> np.ndarray:
        """(2,) N that the object exerts along the surface."""
        return self._pulled * self._pad.shear_stiffness * self._array.taxel_area

    def move(self, touched: np.ndarray, pressure: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """Slip (2, rows, columns) m of an object that moves by shift (3,) over the surface: m, m at the origin, rad.

        touched: (rows, columns) bool, in contact; pressure: (rows, columns) Pa.
        """
        self._drag, self._pull, slip, self._pulled = taxel_move(self._drag, touched, pressure, shift,
                                                                limit=self.friction / self._pad.shear_stiffness, **self._rule)
        self.dragged = True
        return slip

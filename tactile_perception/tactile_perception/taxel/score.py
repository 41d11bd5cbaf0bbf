# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact score of each taxel: pressure relative to that at the border of a contact, which the pad's mechanics gives."""
from __future__ import annotations

import math

import numpy as np

from .._core import taxel_score
from .array import SoftPad, TaxelArray

LEVEL = 0.5  # score at the border of a contact
# Pressure under a bonded elastic layer at the border of a rigid face pressed on it, as a part of that under its inside: 0.59 to 0.63 at
# Poisson ratios of 0.3 to 0.4, whatever the face's width (2.5 to 20 thicknesses) and the load; under 0.6 where the layer can hardly shrink.
BORDER_SHARE = 0.6
# Thicknesses: pressure at the border of a curved face over the slope with which the fitted level runs out to zero there. Derived: at most
# 0.22, 1 / sqrt(2 pi) of the width of the Gaussian by which the pad blurs pressure (shear.FLATTENED). Chosen: less, since the pad
# stiffens under deep presses and its pressure runs out more gently than a paraboloid.
BORDER_RAMP = 0.165
_SMOOTH = 0.5  # thicknesses, of the Gaussian that averages noise, differences of gain and roughness. Chosen
NOISE = 10.0  # standard deviations of the noise, least level. Chosen


class ContactScore:
    """Scores of taxels, above LEVEL in contact; linear in pressure, so that the contour at LEVEL is the border.

    The pad spreads pressure over about its thickness. At the border of a flat face it falls to a fixed part of the level inside
    (BORDER_SHARE), whatever the load; under a curved face the level itself runs out, and a part of its slope is left (BORDER_RAMP). The
    level is a plane, or a quadratic, fitted to each patch.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        thickness = pad.thickness / array.pitch
        self._rule = {'smooth': max(_SMOOTH * thickness, 0.5), 'reach': min(max(1, round(thickness)), max(array.shape)),
                      'share': BORDER_SHARE, 'ramp': BORDER_RAMP * thickness}

    def compute(self, pressure: np.ndarray, sigma: float, full: np.ndarray | None = None) -> np.ndarray:
        """Scores (rows, columns) float32, 0 to 1, of pressure (rows, columns) float32; sigma: its noise, in the same unit; full: (rows,
        columns) bool, taxels that are saturated, None for none."""
        least = NOISE * sigma
        full = np.zeros(pressure.shape, bool) if full is None else full
        return taxel_score(pressure, full, least=least if math.isfinite(least) else 1e30, **self._rule)

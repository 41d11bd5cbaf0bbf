# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: contact score, outlines with subtaxel accuracy and their moments (paper taxel_array_image_processing,
eqs 1 to 3, with I = 1 inside the outline)."""
from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._core import taxel as _kernel
from ..common.surface import Moments
from .pressure import SoftPad, TaxelArray

LEVEL = 0.5  # score at the border of a contact
NOISE = 10.0  # standard deviations of the noise, least level: a false taxel in a hundred thousand frames, also of correlated noise
# Pressure under a bonded elastic layer at the border of a rigid face pressed on it, as a part of that under its inside: 0.59 to 0.63 at
# Poisson ratios of 0.3 to 0.4, whatever the face's width (2.5 to 20 thicknesses) and the load; under 0.6 where the layer can hardly shrink.
BORDER_SHARE = 0.6
# Thicknesses: pressure at the border of a curved face over the slope with which the fitted level runs out to zero there. By theory at most
# 0.22, 1 / sqrt(2 pi) of the width of the Gaussian by which the pad blurs pressure; less, since the pad stiffens under deep presses and its
# pressure runs out more gently than a paraboloid.
_BORDER_RAMP = 0.165
_SMOOTH = 0.5  # thicknesses, of the Gaussian that averages noise, differences of gain and roughness
_AROUND = 2  # taxels around a region that share its force: a pad of 2 mm on taxels of 1 mm (paper)
_MOST = 64  # regions; an image with more is broken: more than fingers can make
_LEAST = 0.25  # taxels, area of a piece: half of what a single taxel of full score has; noise at a border makes smaller ones


class ContactScore:
    """Scores of taxels, above LEVEL in contact; linear in pressure, so that the contour at LEVEL is the border.

    The pad spreads pressure over about its thickness. At the border of a flat face it falls to a fixed part of the level inside
    (BORDER_SHARE), whatever the load; under a curved face the level itself runs out, and a part of its slope is left. The level is a plane,
    or a quadratic, fitted to each patch.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        thickness = pad.thickness / array.pitch
        self._rule = {'smooth': max(_SMOOTH * thickness, 0.5), 'reach': min(max(1, round(thickness)), max(array.shape)),
                      'share': BORDER_SHARE, 'ramp': _BORDER_RAMP * thickness}

    def compute(self, pressure: np.ndarray, sigma: float, full: np.ndarray | None = None) -> np.ndarray:
        """Scores (rows, columns) float32, 0 to 1, of pressure (rows, columns) float32; sigma: its noise, in the same unit; full: (rows,
        columns) bool, taxels that are saturated, None for none."""
        least = NOISE * sigma
        full = np.zeros(pressure.shape, bool) if full is None else full
        return _kernel.contact_score(pressure, full, least=least if math.isfinite(least) else 1e30, **self._rule)


@dataclass(frozen=True)
class Regions:
    """Regions of one frame. all: largest first; labels: (rows, columns) int32, 0 outside; touched: (rows, columns) bool, in contact; near:
    labels extended to the taxels around, which share a region's force; broken: whether the image has more than 64 regions, of which all
    and labels hold the largest."""

    all: list[_kernel.Region]
    labels: np.ndarray
    touched: np.ndarray
    near: np.ndarray
    broken: bool = False

    @property
    def total(self) -> Moments:
        """Moments of all regions together; requires at least one."""
        return sum((region.moments for region in self.all[1:]), self.all[0].moments)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray, reach: float = 0.0,
                 full: np.ndarray | None = None) -> Regions:
    """Regions where score (rows, columns) float32 exceeds LEVEL, with the load of pressure (rows, columns) float32; reach: taxels. Pieces
    nearer to each other are one region: a pad hands on the pressure of two objects nearer than its thickness as that of one. full: (rows,
    columns) bool, taxels that are saturated, None for none."""
    full = np.zeros(score.shape, bool) if full is None else full
    found = _kernel.find_regions(score, pressure, full, level=LEVEL, reach=min(round(0.5 * reach), max(score.shape)), around=_AROUND,
                                 most=_MOST, least=_LEAST, pitch=array.pitch)
    return Regions(found.all, found.labels.reshape(score.shape), score > LEVEL, found.near.reshape(score.shape), found.broken)

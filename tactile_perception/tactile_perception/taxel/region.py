# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: contact score, outlines with subtaxel accuracy, and their moments.

Paper taxel_array_image_processing, eqs 1 to 3, with I = 1 inside the outline.
"""
from __future__ import annotations

import numpy as np

from .._core import taxel as _kernel
from .pressure import SoftPad, TaxelArray


class ContactScore:
    """Contact scores of taxels, above LEVEL in contact.

    They are linear in pressure, so that the contour at LEVEL is the border: src/taxel/region.hpp.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._thickness = pad.thickness / array.pitch

    def compute(self, pressure: np.ndarray, sigma: float, full: np.ndarray | None = None) -> np.ndarray:
        """Compute scores (rows, columns), float32, 0 to 1, from pressure (rows, columns), float32.

        sigma: noise of the pressure, in the same unit; full: (rows, columns) bool, saturated taxels, None for none.
        """
        return _kernel.contact_score(pressure, _or_none(full, pressure), self._thickness, sigma)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray, reach: float = 0.0,
                 full: np.ndarray | None = None) -> _kernel.Regions:
    """Find the regions where score (rows, columns), float32, exceeds LEVEL, with the load of pressure (rows, columns), float32.

    reach: taxels; pieces nearer to each other are one region, because a pad transmits the pressure of two objects nearer than its thickness
    as that of one. full: (rows, columns) bool, saturated taxels, None for none.
    """
    return _kernel.find_regions(score, pressure, _or_none(full, score), array.pitch, reach)


def _or_none(full: np.ndarray | None, image: np.ndarray) -> np.ndarray:
    return np.zeros(image.shape, bool) if full is None else full

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of a contact: the share of its pressure on taxels that slip, with the coefficient of friction learnt from what slipped."""
from __future__ import annotations

import numpy as np

from .._core.force_taxels import SlipFilter
from ..common.estimates import SlipEstimate, next_state


class SlipFinder:
    """Tells sticking from slipping by Coulomb's law and by the changes of shear: src/force_taxels/slip.hpp. tilt: (N,) rad.

    Attributes
    ----------
    filter : SlipFilter
        Probability that the object moves, and that each taxel slips; the coefficient of friction.
    """

    def __init__(self, tilt: np.ndarray):
        self.filter, self._state = SlipFilter(tilt), 0

    @property
    def friction(self) -> float:
        """Mean of the coefficient of friction."""
        return self.filter.friction

    @property
    def friction_sigma(self) -> float:
        """Standard deviation of the coefficient of friction."""
        return self.filter.friction_sigma

    def update(self, force: np.ndarray, noise: np.ndarray, variance: np.ndarray, touched: np.ndarray,
               is_new: np.ndarray, interval: float) -> tuple[SlipEstimate, np.ndarray]:
        """Slip, without positions, and the probability (N,) that each taxel slips.

        force: (N, 3) two tangential components and the pressing one; noise, variance: (N, 3) of white noise and of the offset; touched,
        is_new: (N,), taxels, and those whose reading is not repeated; interval: s since the last frame.
        """
        slips = self.filter.update(force, noise, variance, touched, is_new, interval)
        press = np.where(touched, force[:, 2], 0.0)
        total = float(press.sum())
        if not total > 0:
            self._state = 0
            return SlipEstimate(), slips
        self._state = next_state(self._state, float(press @ (slips > 0.5)) / total)
        found = SlipEstimate(self._state, float(press @ slips) / total)
        if self._state == 0:
            found.linear, found.angular = np.zeros(3), np.zeros(3)
            found.confidence = 1 - float(slips.max())
        else:
            found.confidence = float(slips[slips > 0.5].mean())
        return found, slips

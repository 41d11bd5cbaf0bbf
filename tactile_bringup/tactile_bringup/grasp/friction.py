# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The coefficient of friction between a finger and the object it holds, from forces and partial slip: what sticks and what slips."""
from __future__ import annotations

import math

import numpy as np

from .constants import GRASP

_COEFFICIENTS = np.geomspace(0.03, 4.0, 200)  # of friction: from oiled steel to tacky rubber, and beyond both
_LOG = np.log(_COEFFICIENTS)


def load_share(slipping: float) -> float:
    """Part of the largest possible friction force at which a part of a round contact's area slips.

    Notes
    -----
    Cattaneo and Mindlin: a contact of radius a that bears the shear Q under the normal force P sticks within c, where
    Q / (mu P) = 1 - (c / a)^3 (K. L. Johnson, Contact Mechanics, eq. 7.31).
    """
    return 1.0 - (1.0 - min(slipping, 1.0))**1.5


class FrictionEstimate:
    """The coefficient of friction of one grasp, as a probability over a range of coefficients.

    Where a contact sticks, the coefficient is above the ratio of its forces. Where its border slips as the ratio reaches a new maximum, the
    slipping part shows how near that ratio is to the coefficient. At a smaller ratio the border has slipped before and shows nothing.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the object."""
        self._largest, self._stuck = 0.0, 0.0
        self._slipped: tuple[float, float] | None = None  # the ratio of the last new maximum with slip, and its part of the friction force
        self._update()

    def add(self, normal: float, shear: float, slipping: float) -> None:
        """Take the forces of a contact and the part of it that slips.

        Parameters
        ----------
        normal, shear : float
            Normal and tangential force, N; NaN unknown.
        slipping : float
            Part of the contact that slips, 0 to 1; NaN unknown.
        """
        if not (normal >= GRASP.min_force and shear > 0 and math.isfinite(slipping)):
            return
        ratio = shear / normal
        if slipping < GRASP.min_slipping_share:
            self._stuck = max(ratio, self._stuck)
        elif ratio > self._largest:
            self._slipped = ratio, load_share(slipping)
        self._largest = max(ratio, self._largest)
        self._update()

    @property
    def value(self) -> float:
        """The median."""
        return self._quantile(0.5)

    @property
    def cautious(self) -> float:
        """The coefficient which the true one exceeds with a probability of 0.7."""
        return self._quantile(GRASP.cautious_quantile)

    @property
    def error(self) -> float:
        """Half of the range that holds 68 % of the probability."""
        return 0.5 * (self._quantile(0.84) - self._quantile(0.16))

    def _update(self) -> None:
        """Compute the distribution from what is known."""
        from scipy.special import log_ndtr  # 60 ms, which every node of a sensor would pay: their parameters are in one table
        log = -0.5 * ((_LOG - math.log(GRASP.friction_median)) / GRASP.friction_spread)**2
        if self._stuck:
            log = log + log_ndtr((_LOG - math.log(self._stuck)) / GRASP.ratio_error)
        if self._slipped:
            ratio, part = self._slipped
            log = log - 0.5 * ((_LOG - math.log(ratio / part)) / GRASP.slip_error)**2
        self._below = np.cumsum(np.exp(log - log.max()))

    def _quantile(self, share: float) -> float:
        return float(np.interp(share * self._below[-1], self._below, _COEFFICIENTS))

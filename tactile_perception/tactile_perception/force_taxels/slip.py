# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip: which taxels are at their friction cone while the object moves, with the coefficient of friction learnt from what slipped."""
from __future__ import annotations

import math

import numpy as np

from ..common.estimates import SlipEstimate, next_state
from .motion import ShearMotion

_FAST_S, _SLOW_S = 0.02, 0.06  # time constants of two averages of the ratio of shear to pressure, whose difference is its growth
_COEFFICIENTS = np.geomspace(0.05, 3.0, 60)  # of friction, of skins on objects: ice to clean rubber
_PRIOR = math.log(0.6), math.log(2.0)  # of the logarithm of the coefficient: rubber on common objects, mean and standard deviation
_UNEVEN = 0.08  # relative standard deviation of friction over a surface, and of the ratio of a taxel's gains
_TEXTURE_S = 0.1  # time over which the readings of one slip are not independent
_TREND = 20.0  # standard deviations: prior scale of the change of a ratio that still grows
_OUTLIER = 1e-3  # likelihood of a taxel that fits no coefficient, so that one taxel decides nothing
_FORGET = 0.5  # probability that a new touch is of another object
_MAX_EVIDENCE = 20.0  # of a frame
_TINY = 1e-30  # against a division by zero
_LOGISTIC = 1.702  # a logistic function of this slope is within 0.01 of the normal distribution function, and takes a tenth of the time


class SlipFinder:
    """Tells sticking from slipping by Coulomb's law.

    A taxel slips where the object moves and the ratio of its shear to its pressure is the coefficient of friction, which is the same for
    all taxels of a touch. Motion shows in the changes of the shear forces; the coefficient has a discrete posterior distribution. In it a
    ratio that holds still while the object moves counts as a slip, and every ratio as a lower bound.

    Attributes
    ----------
    friction, friction_sigma : float
        Mean and standard deviation of the coefficient.
    motion : ShearMotion
        Whether the object moves.
    """

    def __init__(self, count: int):
        self._count = count
        log = np.log(_COEFFICIENTS)
        self._prior = -0.5 * ((log - _PRIOR[0]) / _PRIOR[1])**2
        self._prior -= np.logaddexp.reduce(self._prior)
        self._posterior = self._prior.copy()
        self.reset()

    def reset(self) -> None:
        """Start again without a history; what is known of friction is kept."""
        self._press, self._slow, self._age = np.zeros(self._count), np.zeros(self._count), np.zeros(self._count)
        self._touched, self._state = np.zeros(self._count, bool), 0
        self.motion = ShearMotion(self._count)
        self._summarise()

    def _summarise(self) -> None:
        weight = np.exp(self._posterior)
        self.friction = float(weight @ _COEFFICIENTS)
        self.friction_sigma = math.sqrt(max(float(weight @ _COEFFICIENTS**2) - self.friction**2, 0.0))

    def update(self, force: np.ndarray, noise: np.ndarray, variance: np.ndarray, touched: np.ndarray,
               is_new: np.ndarray, interval: float) -> tuple[SlipEstimate, np.ndarray]:
        """Slip, without positions, and the probability (N,) that each taxel slips.

        force: (N, 3) two tangential components and the pressing one; noise, variance: (N, 3) of white noise and of the offset; touched,
        is_new: (N,), taxels, and those whose reading is not repeated; interval: s since the last frame.
        """
        members, was = np.flatnonzero(touched), self._touched
        self._touched = touched
        if not len(members):
            if was.any():
                self._posterior = np.logaddexp(self._posterior + math.log1p(-_FORGET), self._prior + math.log(_FORGET))
                self._summarise()
                self.motion.reset()
            self._state = 0
            return SlipEstimate(), np.zeros(self._count)
        fresh = ~was[members]
        self.motion.update(force[:, :2], noise[:, :2], members, fresh, is_new[members], interval)
        ratio, sigma, trend = self._ratios(force[:, 2], noise, variance, members, fresh, interval)
        age = self._age[members] = np.where(fresh, 0.0, self._age[members] + interval)
        steady = _steady(trend)
        steady = 0.5 + (steady - 0.5) * (1 - np.exp(-age / _SLOW_S))  # of a taxel that has just been touched neither is known
        cone, stick = self._densities(ratio, sigma)
        slips, weight = np.zeros(self._count), np.exp(self._posterior)
        slipping, sticking = (cone @ weight) * steady, (stick @ weight) * (1 - steady)
        slips[members] = self.motion.moving * slipping / (slipping + sticking + _TINY)
        # Taxels that stick grow together: what each alone does not show, all do.
        self._learn(cone, stick, steady * _steady(trend.sum() / math.sqrt(len(trend))), interval)
        return self._estimate(slips[members], force[members, 2]), slips

    def _ratios(self, press, noise, variance, members, fresh, interval) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Ratio of shear to pressure, its standard deviation, and its growth in standard deviations."""
        a, b = (min(interval / (time + 0.5 * interval), 1.0) for time in (_FAST_S, _SLOW_S))
        now = press[members]
        fast = self._press[members] + np.where(fresh, 1.0, a) * (now - self._press[members])
        self._press[members] = fast
        fast = np.maximum(fast, 1e-12)
        shear, white = self.motion.shear[members], self.motion.variance[members]
        size = np.sqrt(shear[:, 0]**2 + shear[:, 1]**2)
        ratio = size / fast
        kept = a / (2 - a)
        own = 0.5 * (white[:, 0] + white[:, 1]) + kept * ratio**2 * noise[members, 2]
        offset = 0.5 * (variance[members, 0] + variance[members, 1]) + ratio**2 * variance[members, 2]
        sigma = np.sqrt(own + offset) / fast
        slow = np.where(fresh, ratio, self._slow[members])
        slow += b * (ratio - slow)
        self._slow[members] = slow
        return ratio, sigma, (ratio - slow) / np.sqrt(own / fast**2 + (0.5 * _UNEVEN * ratio)**2)

    @staticmethod
    def _densities(ratio: np.ndarray, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Densities (M, 60) of the ratio of each taxel, for each coefficient: of one at its cone, and of one that sticks."""
        total = np.sqrt(sigma[:, None]**2 + (_UNEVEN * _COEFFICIENTS)**2)
        beyond = (_COEFFICIENTS - ratio[:, None]) / total
        spread = np.maximum(ratio, _COEFFICIENTS[0]) * math.log(_COEFFICIENTS[-1] / _COEFFICIENTS[0])  # each magnitude is as likely
        stick = 1 / ((1 + np.exp(-_LOGISTIC * np.maximum(beyond, -_MAX_EVIDENCE))) * spread[:, None])
        return np.exp(-0.5 * beyond**2) / (total * math.sqrt(2 * math.pi)), stick

    def _learn(self, cone: np.ndarray, stick: np.ndarray, steady: np.ndarray, interval: float) -> None:
        """Update the posterior of the coefficient. A ratio beyond it is impossible; one that is steady during motion is equal to it."""
        share = steady[:, None]
        evidence = np.log(share * cone + (1 - share) * stick + _OUTLIER).sum(axis=0)
        # At rest the forces are those of the frames before: they say nothing new.
        self._posterior += (min(interval / _TEXTURE_S, 1.0) * self.motion.moving) * evidence
        self._posterior -= np.logaddexp.reduce(self._posterior)
        self._summarise()

    def _estimate(self, slips: np.ndarray, press: np.ndarray) -> SlipEstimate:
        share = np.maximum(press, 0.0)
        share = share / max(float(share.sum()), 1e-12)
        fraction = float(share @ (slips > 0.5))
        self._state = next_state(self._state, fraction)
        found = SlipEstimate(self._state, fraction)
        if self._state == 0:
            found.linear, found.angular = np.zeros(3), np.zeros(3)
            found.confidence = 1 - float(slips.max())
        else:
            found.confidence = float(slips[slips > 0.5].mean())
        return found


def _steady(trend: np.ndarray) -> np.ndarray:
    """Probability that what changed by these standard deviations does not grow."""
    evidence = np.minimum(0.5 * np.maximum(trend, 0.0)**2 * (1 - _TREND**-2) - math.log(_TREND), _MAX_EVIDENCE)
    return 1 / (1 + np.exp(evidence))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of one press, the interface of methods, and the selection of the hypothesis that explains a marker field.

The hypotheses are one straight press, one dragged press, and two presses; sheets and domes share the rule. The evidence of a hypothesis is
its log likelihood at the best fit, minus half the log number of values for each fitted number (Schwarz 1978), plus its log prior. With
other tips, frictions and paths than in calibration, displacements deviate more than noise and known model error predict. The scale of the
errors is therefore unknown, and the likelihood of n values with a residual chi-square q per value is q^(-n/2). Model errors are smooth, so
that neighbouring markers have similar errors, and n is smaller than the number of markers.
"""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from typing import Protocol

import numpy as np

from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE
from .constants import PRESS
from .field import MarkerField

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'Choice', 'Evidence', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """Estimate of one contact.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Lowest point of the object in m in the sensor frame (z = -depth on a sheet); of two presses, the centre of each contact.
    depth : float
        Distance in m along z by which the object would have to be lifted to just touch the undeformed surface.
    covariance : ndarray, shape (3, 3)
        Covariance of position in m^2.
    depth_sigma : float
        Standard deviation of depth in m.
    radius : float
        Radius of the object's tip in m; NaN if the method does not estimate it.
    flags : int
        OUT_OF_RANGE, AT_EDGE, AMBIGUOUS.
    wrench : ndarray, shape (6,)
        Wrench of the object on the sensor, at the origin of the sensor frame, over the stiffness of the skin, in m and m^2; NaN if the
        method does not estimate it.
    lowest : ndarray, shape (3,), or None
        Lowest point of the object in m; None if it is position.
    """

    position: np.ndarray
    depth: float
    covariance: np.ndarray
    depth_sigma: float
    radius: float = float('nan')
    flags: int = 0
    wrench: np.ndarray = field(default_factory=partial(np.full, 6, np.nan))
    lowest: np.ndarray | None = None


class TouchMethod(Protocol):
    """A method that is calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """Estimate the contacts of one frame; empty without contact."""


class Hypothesis(Enum):
    """A hypothesis; its value is how many numbers are fitted."""

    STRAIGHT = 3
    DRAGGED = 5
    TWO = 8

    @property
    def prior(self) -> float:
        """Prior odds over a straight press."""
        return {Hypothesis.DRAGGED: PRESS.dragged_odds, Hypothesis.TWO: PRESS.two_odds}.get(self, 1.0)


class Evidence:
    """Compares hypotheses.

    values: number of values, two or three for each visible marker; expected: chi-square of presses under their own hypothesis, below which
    a fit counts as no better.
    """

    def __init__(self, values: int, expected: float):
        self._count, self._expected = max(values / PRESS.values_per_error, 2.0), expected

    def of(self, hypothesis: Hypothesis, chi_square: float) -> float:
        """Compute the log evidence; chi_square: of the residuals, per value."""
        misfit = self._count * math.log(max(chi_square, self._expected))
        return math.log(hypothesis.prior) - 0.5 * (misfit + hypothesis.value * math.log(self._count))

    def may_win(self, hypothesis: Hypothesis, known: float) -> bool:
        """Whether a perfect fit of a hypothesis would exceed a known log evidence."""
        return self.of(hypothesis, self._expected) > known

    def is_explained(self, fit) -> bool:
        """Whether the residual of a fit is at most that expected of the model error."""
        return fit.misfit <= self._expected * fit.expected


class Choice:
    """Selects the hypothesis of the largest evidence frame by frame.

    Attributes
    ----------
    one : object or None
        Fit of one press to the last frame with one press.
    dragged : bool
        Whether that was a drag. A drag persists until contact ends, because friction holds the skin while the tip is lifted.
    radius : tuple of float or None
        Radius of the last straight press, which a dragged tip keeps.
    two : object or None
        The presses of the last frame if they were two.
    """

    def __init__(self):
        self.one, self.dragged, self.radius, self.two = None, False, None, None

    def explain(self, evidence: Evidence, solve: Callable, begin, two: Callable):
        """Fit the hypotheses to a frame and return the fit of the best one.

        solve(start, dragged) fits one press, a straight one from begin. two() fits two presses; it is called if the residual of one press
        exceeds the expected model error, which grows with drags. A fit has presses, misfit (residual chi-square per value), expected (that
        of the model error over that of a straight press), and radius (mean and standard deviation of the tip's).
        """
        dragged = self.dragged
        single = solve(self.one.presses if dragged else begin, dragged)
        best = evidence.of(Hypothesis.DRAGGED if dragged else Hypothesis.STRAIGHT, single.misfit)
        if not dragged and evidence.may_win(Hypothesis.DRAGGED, best):
            drag = solve(single.presses, True)
            if evidence.of(Hypothesis.DRAGGED, drag.misfit) > best:
                single, best, dragged = drag, evidence.of(Hypothesis.DRAGGED, drag.misfit), True
        if not evidence.is_explained(single) and evidence.may_win(Hypothesis.TWO, best):
            pair = two()
            if evidence.of(Hypothesis.TWO, pair.misfit) > best:
                self.two = pair.presses
                return pair
        self.one, self.dragged, self.two = single, dragged, None
        if not dragged and single.radius[1] > 0:  # the fit did not fail
            self.radius = single.radius
        return single

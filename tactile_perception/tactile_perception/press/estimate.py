# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The estimate of one press, the interface of methods, and the choice of what explains a marker field: one press straight in, one that is
dragged, or two; one rule for sheets and domes.

The evidence of a hypothesis is its likelihood at the best fit, less half the log number of values for each number that was fitted (Schwarz
1978), plus its log prior. Displacements are not as exact as noise and the model's known error say where tips, frictions and paths are
others than in calibration: the scale of the errors is unknown, so that the likelihood of n values with a residual chi-square q per value is
q^(-n/2). Model errors are smooth: neighbouring markers err alike, and n is smaller than the number of markers.
"""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np

from ..common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE
from .field import MarkerField

__all__ = ['AMBIGUOUS', 'AT_EDGE', 'OUT_OF_RANGE', 'Choice', 'Evidence', 'TouchEstimate', 'TouchMethod']


@dataclass(frozen=True)
class TouchEstimate:
    """One touch.

    position: (3,) m, sensor frame, of the object's lowest point (z = -depth on a sheet), of each of two the centre of its contact; depth:
    m, distance along z by which the object would have to be lifted to just touch the undeformed surface; covariance: (3, 3) m^2 of
    position; depth_sigma: m, standard deviation of depth; radius: m of the object's tip, NaN where the method does not estimate it;
    flags: OUT_OF_RANGE, AT_EDGE, AMBIGUOUS; wrench: (6,) of the object on the sensor at the sensor frame's origin over the stiffness of the
    skin, m and m^2, NaN where the method does not estimate it; lowest: (3,) m, of the object's lowest point, None where it is position.
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
    """A method, calibrated for one sensor."""

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where nothing touches."""


#: A model error is shared by so many values, since it is smooth over some pitches. Chosen on simulated presses, drags and pairs of a sheet.
ALIKE = 20.0


class Hypothesis(NamedTuple):
    """numbers: that are fitted; prior: log of the share of frames in which it holds."""

    numbers: int
    prior: float


#: Tips press straight in or are dragged about as often; two at once is one frame in twenty, on a hand as in recordings.
STRAIGHT, DRAGGED, TWO = Hypothesis(3, math.log(0.5)), Hypothesis(5, math.log(0.45)), Hypothesis(8, math.log(0.05))


class Evidence:
    """Compares hypotheses on a number of values, two or three of each marker that is seen; least: chi-square below which a fit is not
    better, that of presses under their own hypothesis."""

    def __init__(self, values: int, least: float):
        self._count, self._least = max(values / ALIKE, 2.0), least

    def of(self, hypothesis: Hypothesis, chi_square: float) -> float:
        """Log evidence; chi_square: of the residuals, per value."""
        return hypothesis.prior - 0.5 * (self._count * math.log(max(chi_square, self._least)) + hypothesis.numbers * math.log(self._count))

    def may_win(self, hypothesis: Hypothesis, known: float) -> bool:
        """Whether a perfect fit of a hypothesis would have more than a known log evidence."""
        return self.of(hypothesis, self._least) > known

    def is_explained(self, fit) -> bool:
        """Whether a fit leaves no more than its model error is expected to."""
        return fit.misfit <= self._least * fit.expected


class Choice:
    """The hypothesis of most evidence for each frame of a skin. one: the fit of one press to the last frame that had one, None without;
    dragged: whether it was a drag, which lasts until the touch ends, as friction holds the skin while the tip is lifted; radius: of the
    last press straight in, which a tip that is dragged keeps, None without one; two: the presses of the last frame if they were two, else
    None."""

    def __init__(self):
        self.one, self.dragged, self.radius, self.two = None, False, None, None

    def explain(self, evidence: Evidence, solve: Callable, begin, two: Callable):
        """The fit to a frame: solve(start, dragged) fits one press, straight from begin, to it; two() fits two at once, where one leaves
        more than its model error, which grows with drags. A fit has presses, a misfit, the residual chi-square per value, what is expected
        of that, over a straight press's, and radius, mean and standard deviation of what it tells of the tip's."""
        dragged = self.dragged
        single = solve(self.one.presses if dragged else begin, dragged)
        most = evidence.of(DRAGGED if dragged else STRAIGHT, single.misfit)
        if not dragged and evidence.may_win(DRAGGED, most):
            drag = solve(single.presses, True)
            if evidence.of(DRAGGED, drag.misfit) > most:
                single, most, dragged = drag, evidence.of(DRAGGED, drag.misfit), True
        if not evidence.is_explained(single) and evidence.may_win(TWO, most):
            both = two()
            if evidence.of(TWO, both.misfit) > most:
                self.two = both.presses
                return both
        self.one, self.dragged, self.two = single, dragged, None
        if not dragged and single.radius[1] > 0:  # not of a fit that failed
            self.radius = single.radius
        return single

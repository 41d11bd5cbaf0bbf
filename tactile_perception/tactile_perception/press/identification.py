# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Identification of a skin and its tip: least squares over a few numbers, each value of which takes simulated presses."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

EVALUATIONS = 12  # of the residuals, at most, beside their slopes. Chosen
GAINED = 0.02     # of the cost: a step that gains less is the last. Chosen
STEP = 0.15       # finite difference over the prior's standard deviation. Chosen: simulations converge to less

Residuals = Callable[[list[np.ndarray]], list[np.ndarray]]


@dataclass(frozen=True)
class Prior:
    """Of the numbers: mean and standard deviation; least, most: bounds. (V,) each."""

    mean: np.ndarray
    sigma: np.ndarray
    least: np.ndarray
    most: np.ndarray


def identify(residuals: Residuals, starts: list[np.ndarray], prior: Prior, evaluations: int = EVALUATIONS) -> tuple[np.ndarray, float]:
    """The numbers (V,) of least squares from the best of starts, and half the sum of squares, the prior's included.

    residuals: of several numbers at once, so that all cores are busy: (N,) each, in standard deviations. Steps are limited by a trust
    region in units of the prior (scipy.optimize.least_squares).
    """
    from scipy.optimize import least_squares  # calibration alone needs it

    def numbers(units: np.ndarray) -> np.ndarray:
        return prior.mean + prior.sigma * units

    known: dict[bytes, np.ndarray] = {}

    def left(units: np.ndarray) -> np.ndarray:
        """(N + V,) residuals, the prior's last."""
        if units.tobytes() not in known:  # the slopes need those of the same numbers again
            known[units.tobytes()] = residuals([numbers(units)])[0]
        return np.append(known[units.tobytes()], units)

    def slopes(units: np.ndarray) -> np.ndarray:
        """(N + V, V) of left, by finite differences."""
        steps = np.where(units + STEP > high, -STEP, STEP)
        moved = residuals([numbers(units + step) for step in np.diag(steps)])
        return np.vstack([(np.array(moved) - left(units)[:-len(units)]).T / steps, np.eye(len(units))])

    low, high = ((bound - prior.mean) / prior.sigma for bound in (prior.least, prior.most))
    begin = [np.clip((start - prior.mean) / prior.sigma, low + 1e-6, high - 1e-6) for start in starts]
    costs = [np.sum(rest**2) + np.sum(units**2) for rest, units in zip(residuals([numbers(units) for units in begin]), begin)]
    found = least_squares(left, begin[int(np.argmin(costs))], slopes, bounds=(low, high), ftol=GAINED, xtol=1e-3, max_nfev=evaluations)
    return numbers(found.x), float(found.cost)

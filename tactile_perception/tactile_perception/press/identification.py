# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Identification of a skin and its tip: least squares over a few numbers, each value of which takes simulated presses."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

EVALUATIONS = 10  # at most, beside the first slopes. Chosen
GAINED = 0.005    # of the cost: a step that gains less is the last. Chosen
STEP = 0.15       # finite difference over the prior's standard deviation. Chosen: simulations converge to less

Residuals = Callable[[list[np.ndarray]], list[np.ndarray]]


@dataclass(frozen=True)
class Prior:
    """Of the numbers: mean and standard deviation; least, most: bounds. (V,) each."""

    mean: np.ndarray
    sigma: np.ndarray
    least: np.ndarray
    most: np.ndarray


def identify(residuals: Residuals, starts: list[np.ndarray], prior: Prior) -> np.ndarray:
    """The numbers (V,) of least squares from the best of starts, the prior's included.

    residuals: of several numbers at once, so that all cores are busy: (N,) each, in standard deviations. Steps are limited by a trust
    region in units of the prior (scipy.optimize.least_squares). Slopes are finite differences at the start, and then follow what the steps
    have shown (Broyden 1965): each value of the residuals takes simulated presses.
    """
    low, high = ((bound - prior.mean) / prior.sigma for bound in (prior.least, prior.most))

    def left(several: list[np.ndarray]) -> list[np.ndarray]:
        """(N + V,) residuals each, the prior's last."""
        found = residuals([prior.mean + prior.sigma * units for units in several])
        return [np.append(rest, units) for rest, units in zip(found, several)]

    begin = [np.clip((start - prior.mean) / prior.sigma, low + 1e-6, high - 1e-6) for start in starts]
    tried = left(begin)
    best = int(np.argmin([rest @ rest for rest in tried]))
    at, here = begin[best], tried[best]
    steps = np.where(at + STEP > high, -STEP, STEP)
    slope = (np.array(left([at + step for step in np.diag(steps)])) - here).T / steps
    return prior.mean + prior.sigma * _least_squares(lambda units: left([units])[0], at, slope, (low, high))


def _least_squares(left: Callable[[np.ndarray], np.ndarray], start: np.ndarray, slope: np.ndarray, bounds: tuple) -> np.ndarray:
    """Where left is least; slope: its slopes at the start."""
    from scipy.optimize import least_squares  # calibration alone needs it
    known, last = {}, []

    def value(units: np.ndarray) -> np.ndarray:
        known[units.tobytes()] = left(units)
        return known[units.tobytes()]

    def slopes(units: np.ndarray) -> np.ndarray:
        """Asked for at units whose value is known."""
        nonlocal slope, last
        now = known[units.tobytes()]
        for before, then in last:
            step = units - before
            slope = slope + np.outer(now - then - slope @ step, step) / (step @ step)
        last = [(units.copy(), now)]
        return slope

    return least_squares(value, start, slopes, bounds=bounds, ftol=GAINED, xtol=1e-3, max_nfev=EVALUATIONS).x


def beyond(errors: np.ndarray, variances: np.ndarray) -> float:
    """Standard deviation that most of errors (N, axes) show beyond their variances (N, axes)."""
    return float(np.sqrt(max(np.median(np.mean(errors**2 - variances, axis=1)), 0.0)))

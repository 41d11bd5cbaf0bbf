# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Gauss-Newton fit of a bell to the displacement of a sheet's markers, with a prior on its shape.

Smooth in-plane displacements (sine modes) that the bell does not explain are marginalised. Where the calibration contains drags, the
lateral displacement of the sheet at the tip is fitted too.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .green_function import CARRIED, DEPTH, PLACE, ROUND, SheetBell

STEPS = np.array([1e-6, 1e-6, 1e-4, 1e-4, 1e-4, 1e-6, 1e-6])  # of the finite differences, in the parameters' units
ITERATIONS, DERIVED = 8, 2  # at most; first iterations, in which the Jacobian is renewed. Chosen
DRAGGED = 12          # both of these, where drags are fitted. Chosen
SETTLED = 8e-3        # of the step limit: a smaller step ends the iteration. Chosen
MODES = 4             # marginalised in-plane modes along each axis. Chosen
ASTRAY = 0.1          # of the short side: limit of one step. Chosen
MISFIT, MISFIT_TOP = 0.003, 0.015  # model error of depth over the greatest depth, and over the marker's own. Chosen
SIDEWAYS = 0.02       # model error of in-plane displacement over depth, at a depth of a fifth of the short side. Chosen


@dataclass(frozen=True)
class ShapePrior:
    """Log tip width and log power, linear in (1, log of depth over a twentieth of the short side, x^2, y^2 over the half sides squared).

    coefficients: (2, 4); sigma: (2,) standard deviations.
    """

    coefficients: np.ndarray
    sigma: np.ndarray


@dataclass(frozen=True)
class BellFit:
    """parameters: (7,) as in green_function; covariance: (7, 7); misfit: mean square of the normalised residuals."""

    parameters: np.ndarray
    covariance: np.ndarray
    misfit: float


def broad_prior(size: np.ndarray) -> ShapePrior:
    """Before calibration: a tip width of some hundredths of the sheet, a power of one."""
    coefficients = np.zeros((2, 4))
    coefficients[0, :2] = np.log(0.07 * min(size)), 0.4
    return ShapePrior(coefficients, np.array([0.5, 0.05]))


class BellFitter:
    """Fits bells to apparent displacements (K, 2) m of known noise (K,) m. drag: m, standard deviation of lateral displacement."""

    def __init__(self, bell: SheetBell, rest: np.ndarray, prior: ShapePrior, drag: float = 0.0):
        self.bell, self.prior, self.drag = bell, prior, drag
        self.short, self.half = bell.size.min(), bell.size / 2
        self._modes, self._stiff = _sideways(rest, bell.size)
        self._reach = np.hypot(*bell.out.T)

    def shape_basis(self, parameters: np.ndarray) -> np.ndarray:
        """(4,) regressors of the shape's prior."""
        x, y = (parameters[PLACE] / self.half)**2
        return np.array([1.0, parameters[DEPTH] - np.log(self.short / 20), x, y])

    def fit(self, shift: np.ndarray, sigma: np.ndarray, start: np.ndarray, hold: bool = False) -> BellFit:
        """Fit to shift (K, 2) m, NaN where not seen, with sigma (K,) m; start: (3,) place, m, and log depth, fixed if hold."""
        known = np.repeat(np.isfinite(shift).all(1) & np.isfinite(self._reach), 2)
        observed = np.where(known, shift.ravel(), 0.0)
        parameters = np.append(start, np.zeros(4))
        parameters[ROUND:CARRIED.start] = self.prior.coefficients @ self.shape_basis(parameters)
        loose = np.arange(3 if hold else 0, CARRIED.stop if self.drag else CARRIED.start)
        limit = np.array([ASTRAY * self.short] * 2 + [0.7, 0.5, 0.2] + [ASTRAY * self.short] * 2)
        iterations, derived = (DRAGGED, DRAGGED) if self.drag else (ITERATIONS, DERIVED)
        for turn in range(iterations):
            anew = turn < derived
            predicted, deep = self.bell.predict(np.vstack([parameters, parameters + np.diag(STEPS)[loose]])[:, :loose[-1] + 1] if anew
                                           else parameters[None, :loose[-1] + 1])
            if anew:
                slope = np.nan_to_num((predicted[1:] - predicted[0]) / STEPS[loose, None]).T
                system = self._system(known, sigma, deep[0], np.exp(parameters[DEPTH]))
            residual = np.where(known, observed - predicted[0], 0.0)
            normal, pull, squares = system.reduce(slope, residual)
            normal, pull = self._add_prior(parameters, loose, normal, pull)
            step = np.linalg.solve(normal, pull)
            step *= min(1.0, (limit[loose] / np.maximum(np.abs(step), 1e-15)).min())
            parameters[loose] += step
            if (np.abs(step) < SETTLED * limit[loose]).all():
                break
        covariance = np.zeros((7, 7))
        covariance[np.ix_(loose, loose)] = np.linalg.inv(normal)
        return BellFit(parameters, covariance, float(squares / max(known.sum(), 1)))

    def _add_prior(self, parameters, loose, normal, pull):
        off = parameters[ROUND:] - np.append(self.prior.coefficients @ self.shape_basis(parameters), [0.0, 0.0])
        sigma = np.append(self.prior.sigma, [self.drag or 1.0] * 2)
        rows = np.zeros((4, 7))
        rows[:, ROUND:] = np.eye(4)
        rows[:2, DEPTH] = -self.prior.coefficients[:, 1]
        rows[:2, PLACE] = -self.prior.coefficients[:, 2:] * 2 * parameters[PLACE] / self.half**2
        rows = rows[:, loose] / sigma[:, None]
        return normal + rows.T @ rows, pull - rows.T @ (off / sigma)

    def _system(self, known, sigma, deep, depth):
        steepness = np.clip(depth / (0.2 * self.short), 0.1, 2.0)
        wrong = (MISFIT * depth + MISFIT_TOP * deep) * self._reach / self.bell.height
        variance = np.repeat(sigma**2 + wrong**2 / 2 + (SIDEWAYS * deep * steepness)**2, 2)
        weight = np.where(known, 1 / variance, 0.0)
        return _System(weight, self._modes, self._stiff / (SIDEWAYS * depth * steepness)**2)


class _System:
    """Normal equations with the in-plane modes marginalised."""

    def __init__(self, weight, modes, stiff):
        self.weight, self.modes = weight[:, None], np.where(weight[:, None] > 0, modes, 0.0)
        self.weighted = self.modes * self.weight
        self.inverse = np.linalg.inv(self.weighted.T @ self.modes + np.diag(stiff))

    def reduce(self, slope, residual):
        """Normal matrix, right side and weighted squared residual of slope (N, P) and residual (N,), modes marginalised."""
        both = np.column_stack([slope, residual])
        crossed = self.weighted.T @ both
        normal = both.T @ (both * self.weight) - crossed.T @ (self.inverse @ crossed)
        return normal[:-1, :-1], normal[:-1, -1], normal[-1, -1]


def _sideways(rest: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(2 K, n) modes and (n,) their stiffness."""
    x, y = (np.pi * np.arange(1, MODES + 1) * (rest[:, side, None] / size[side] + 0.5) for side in (0, 1))
    shape = (np.sin(x)[:, :, None] * np.sin(y)[:, None, :]).reshape(len(rest), -1)
    modes = np.zeros((len(rest), 2, 2 * shape.shape[1]))
    modes[:, 0, :shape.shape[1]], modes[:, 1, shape.shape[1]:] = shape, shape
    order = np.arange(1, MODES + 1)**2
    return modes.reshape(2 * len(rest), -1), np.tile((order[:, None] + order).ravel() / 2.0, 2)

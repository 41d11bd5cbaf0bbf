# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fit of one or two learned dents (dome_basis) to a frame of a dome: Gauss-Newton from the best match in a library of starts."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .dome_basis import LOG_DEPTH, LOG_SHAPE, Dent
from ..view.marker_field import MarkerField

STEPS = np.array([1e-5, 1e-5, 1e-4, 1e-4])  # of the finite differences: m, m, log, log
LIMIT = np.array([0.01, 0.01, 0.5, 0.5])  # of one Gauss-Newton step. Chosen
LEAST = np.array([1e2, 1e2, 0.1, 0.1])  # 1/m^2 and 1: prior information, for unobservable parameters. Chosen
SETTLED = 3e-3           # of LIMIT: a smaller step ends the iteration. Chosen
FAINTEST, DEEPEST = -14.0, 2.0  # bounds of depth: log of m; times the deepest press. Chosen
ITERATIONS = 10          # at most
FOLLOW = 3               # first iterations, in which the Jacobian is renewed. Chosen
SHAPE_SIGMA = 0.03       # standard deviation of log shape depth over depth. Chosen
MISFIT, MISFIT_TOP = 0.02, 0.006  # model error over a marker's displacement, and over the greatest. Chosen
RINGS, DEPTHS = (0.0, 0.07, 0.14, 0.21, 0.28, 0.35, 0.42), (0.15, 0.4, 0.7, 1.0)  # starts, of rim radius and deepest press. Chosen
APART = 2.2              # pitches: least distance of two touches. Chosen


@dataclass(frozen=True)
class DentFound:
    """parameters: (n, 4) of n dents; covariance: (4 n, 4 n); squares: sum of the squared normalised residuals."""

    parameters: np.ndarray
    covariance: np.ndarray
    squares: float


class DentSolver:
    """noise: m, of displacements, where a field has no sigma; deepest: m, calibrated press; pitch: m, of markers."""

    def __init__(self, dent: Dent, noise: float, deepest: float, pitch: float):
        self.dent, self.noise = dent, noise
        rim, most = dent.cap.rim_radius, np.log(DEEPEST * deepest)
        self._range = np.array([-rim, -rim, FAINTEST, FAINTEST]), np.array([rim, rim, most, most])
        self._starts = _library(dent.cap.rim_radius, deepest)
        self._shown = np.nan_to_num([dent.appear(start) for start in self._starts]).reshape(len(self._starts), -1)
        gram = self._shown @ self._shown.T
        self._sizes = np.diag(gram).copy()
        apart = np.hypot(*(self._starts[:, None, :2] - self._starts[:, :2]).transpose(2, 0, 1))
        self._both = np.where(apart >= APART * pitch, 2 * gram + self._sizes[:, None] + self._sizes, np.inf)

    def score(self, field: MarkerField) -> float:
        """Match of the best starting dent, in standard deviations of noise."""
        match = self._shown @ np.nan_to_num(field.shift).ravel()
        return float((match / np.sqrt(self._sizes)).max() / np.median(self._sigma(field)[field.seen]))

    def start(self, field: MarkerField) -> np.ndarray:
        """(1, 4), the starting dent with the least squared residual."""
        match = self._shown @ np.nan_to_num(field.shift).ravel()
        return self._starts[[np.argmin(self._sizes - 2 * match)]]

    def start_of_two(self, field: MarkerField) -> np.ndarray:
        """(2, 4), the two starting dents whose sum has the least squared residual."""
        match = self._shown @ np.nan_to_num(field.shift).ravel()
        return self._starts[list(np.unravel_index(np.argmin(self._both - 2 * (match[:, None] + match)), self._both.shape))]

    def moved(self, found: DentFound) -> np.ndarray:
        """(K, 3) m, displacement of the markers under the dents found."""
        return sum(self.dent.moved(one) for one in found.parameters)

    def solve(self, field: MarkerField, starts: np.ndarray) -> DentFound:
        """Least-squares fit of n dents to a field, from starts (n, 4)."""
        parameters, seen = starts.copy(), np.repeat(field.seen, 2)
        shift = np.where(seen, np.nan_to_num(field.shift).ravel(), 0.0)
        weight = np.where(seen, self._weight(field), 0.0)
        limit = np.tile(LIMIT, len(starts))
        for turn in range(ITERATIONS):
            fields = [self.dent.fields(one[:2]) for one in parameters]
            moved = [self.dent.powers(one) @ field for one, field in zip(parameters, fields)]
            predicted = np.nan_to_num(self.dent.seen_at(sum(moved))).ravel()
            if turn < FOLLOW:
                slope = self._slope(parameters, fields, moved, predicted)
            normal, pull = _with_prior(parameters, slope.T @ (slope * weight[:, None]), slope.T @ ((shift - predicted) * weight))
            normal[np.diag_indices_from(normal)] += np.tile(LEAST, len(starts))
            size = 1 / np.sqrt(np.diag(normal))
            step = size * np.linalg.solve(normal * np.outer(size, size), pull * size)
            step *= min(1.0, (limit / np.maximum(np.abs(step), 1e-15)).min())
            parameters = np.clip(parameters + step.reshape(-1, 4), *self._range)
            if (np.abs(step) < SETTLED * limit).all():
                break
        left = shift - np.nan_to_num(self.dent.seen_at(sum(self.dent.moved(one) for one in parameters))).ravel()
        covariance = np.linalg.inv(normal * np.outer(size, size)) * np.outer(size, size)
        return DentFound(parameters, covariance, float(np.sum(weight * left**2)))

    def _slope(self, parameters, fields, moved, predicted) -> np.ndarray:
        columns = []
        for k, one in enumerate(parameters):
            others = sum(moved[:k] + moved[k + 1:], np.zeros_like(moved[k]))
            for number, step in enumerate(np.diag(STEPS)):  # the modes depend on the place alone
                field = fields[k] if number >= LOG_DEPTH else self.dent.fields((one + step)[:2])
                columns.append(self.dent.seen_at(others + self.dent.powers(one + step) @ field).ravel() - predicted)
        return np.nan_to_num(np.stack(columns, axis=1)) / np.tile(STEPS, len(parameters))

    def _weight(self, field: MarkerField) -> np.ndarray:
        size = np.hypot(*np.nan_to_num(field.shift).T)
        return 1 / np.repeat(self._sigma(field)**2 + (MISFIT * size)**2 + (MISFIT_TOP * size.max())**2, 2)

    def _sigma(self, field: MarkerField) -> np.ndarray:
        return np.where(np.isfinite(field.sigma), np.maximum(field.sigma, self.noise / 2), self.noise)


def _with_prior(parameters, normal, pull):
    """Normal equations with the prior that a dent's shape depth is near its depth."""
    for k, one in enumerate(parameters):
        alike = np.zeros(4 * len(parameters))
        alike[[4 * k + LOG_DEPTH, 4 * k + LOG_SHAPE]] = -1.0, 1.0
        normal = normal + np.outer(alike, alike) / SHAPE_SIGMA**2
        pull = pull - alike * (one[LOG_SHAPE] - one[LOG_DEPTH]) / SHAPE_SIGMA**2
    return normal, pull


def _library(rim_radius: float, deepest: float) -> np.ndarray:
    """(S, 4) starting dents all over the dome."""
    starts = []
    for ring in RINGS:
        count = max(1, round(2 * np.pi * ring / RINGS[1]))
        for turn in np.arange(count) * 2 * np.pi / count:
            place = ring * rim_radius * np.array([np.cos(turn), np.sin(turn)])
            starts += [[*place, np.log(part * deepest), np.log(part * deepest)] for part in DEPTHS]
    return np.array(starts)

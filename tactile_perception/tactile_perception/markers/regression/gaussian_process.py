# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Gaussian-process regression with a Matern 5/2 kernel, even or odd under a sheet's mirror symmetries; hyperparameters by evidence."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy

MIRRORS = np.array([(1, 1), (-1, 1), (1, -1), (-1, -1)], float)
MOST_FOR_EVIDENCE = 120  # points used for the hyperparameters. Chosen: the time grows with the cube
_ROOT = np.sqrt(5.0)


def parity_signs(parity: tuple[int, int]) -> np.ndarray:
    """(4,) sign of a function under each mirror; parity: 1 even, -1 odd, along x and along y."""
    return np.array([(parity[0] if x < 0 else 1) * (parity[1] if y < 0 else 1) for x, y in MIRRORS], float)


class MirrorGP:
    """inputs: (N, D), the first two mirrored; values: (N,); noise: (N,) known standard deviations of the values.

    hyper: (D + 2,) log length scales, log amplitude and log noise, the latter two over the values' RMS.
    """

    def __init__(self, inputs, values, noise, parity, hyper=None):
        self.inputs, self.values, self.noise, self.parity = inputs, values, noise, parity
        self.signs, self.scale = parity_signs(parity), max(float(np.sqrt(np.mean(values**2))), 1e-12)
        self.hyper = np.array(hyper, float) if hyper is not None else self._find()
        self._factor = scipy.linalg.cholesky(self._covariance(self.hyper, slice(None)), lower=True)
        self._dual = scipy.linalg.cho_solve((self._factor, True), self.values / self.scale)
        self._copies = (inputs * self._flips()[:, None]).reshape(-1, inputs.shape[1])

    def __call__(self, at: np.ndarray) -> float:
        """The value at (D,)."""
        return float(self._row(at) @ self._dual * self.scale)

    def sigma(self, at: np.ndarray) -> float:
        """Standard deviation of the value at (D,), noise included."""
        white = scipy.linalg.solve_triangular(self._factor, self._row(at), lower=True)
        height, noise = np.exp(2 * self.hyper[-2:])
        top = height * (self.signs @ _matern((at * self._flips() - at) / np.exp(self.hyper[:-2])))
        return float(self.scale * np.sqrt(max(top - white @ white, 0.0) + noise))

    def left_out(self, groups: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Errors (N,) and standard deviations (N,) of the prediction of each value from the other groups (leave-group-out)."""
        inverse = scipy.linalg.cho_solve((self._factor, True), np.eye(len(self.values)))
        errors, sigmas = np.zeros(len(groups)), np.zeros(len(groups))
        for group in np.unique(groups):
            held = groups == group
            block = np.linalg.inv(inverse[np.ix_(held, held)])
            errors[held], sigmas[held] = block @ self._dual[held] * self.scale, np.sqrt(np.diag(block)) * self.scale
        return errors, sigmas

    def numbers(self) -> dict:
        """For the calibration file."""
        return {'inputs': self.inputs.tolist(), 'values': self.values.tolist(), 'noise': self.noise.tolist(), 'parity': list(self.parity),
                'hyper': self.hyper.tolist()}

    @classmethod
    def from_numbers(cls, numbers: Mapping) -> MirrorGP:
        """From the calibration file."""
        inputs, values, noise = (np.array(numbers[name], float) for name in ('inputs', 'values', 'noise'))
        return cls(inputs, values, noise, tuple(numbers['parity']), numbers['hyper'])

    def _flips(self) -> np.ndarray:
        return np.hstack([MIRRORS, np.ones((4, self.inputs.shape[1] - 2))])

    def _row(self, at):
        gaps = (self._copies - at) / np.exp(self.hyper[:-2])
        return np.exp(2 * self.hyper[-2]) * (self.signs @ _matern(gaps).reshape(4, -1))

    def _covariance(self, hyper, some):
        inputs = self.inputs[some] / np.exp(hyper[:-2])
        kernel = sum(sign * _matern(inputs[:, None] - inputs * flip) for sign, flip in zip(self.signs, self._flips()))
        own = np.exp(2 * hyper[-1]) + (self.noise[some] / self.scale)**2 + 1e-8
        return np.exp(2 * hyper[-2]) * kernel + np.diag(own)

    def _find(self) -> np.ndarray:
        some = np.unique(np.linspace(0, len(self.values) - 1, min(MOST_FOR_EVIDENCE, len(self.values))).astype(int))
        target, inner = self.values[some] / self.scale, self.inputs.shape[1]
        middle = np.append(np.zeros(inner), [0.0, np.log(0.1)])
        width = np.append(np.full(inner, 0.7), [1.0, 1.0])

        def cost(hyper):
            """Negative log posterior of the hyperparameters."""
            try:
                lower = np.linalg.cholesky(self._covariance(hyper, some))
            except np.linalg.LinAlgError:
                return 1e10
            white = np.linalg.solve(lower, target)
            return 0.5 * white @ white + np.log(np.diag(lower)).sum() + 0.5 * np.sum(((hyper - middle) / width)**2)
        bounds = [(-1.5, 3.0)] * inner + [(-4.0, 3.0), (np.log(5e-3), 1.0)]
        return scipy.optimize.minimize(cost, middle, method='L-BFGS-B', bounds=bounds).x


def _matern(gaps: np.ndarray) -> np.ndarray:
    apart = _ROOT * np.sqrt(np.sum(gaps**2, axis=-1))
    return (1 + apart + apart**2 / 3) * np.exp(-apart)


def mirror_groups(places: np.ndarray) -> np.ndarray:
    """(N,) group ids: places (N, 2) m that are mirror images of each other, within a millimetre, share one."""
    _, group = np.unique(np.round(np.abs(places), 3), axis=0, return_inverse=True)
    return group.ravel()

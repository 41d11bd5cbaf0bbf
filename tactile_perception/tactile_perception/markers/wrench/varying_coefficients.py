# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Varying-coefficient regression: value = sum over features of feature times coefficient(state).

Each coefficient is a zero-mean Gaussian process with a squared exponential kernel; length scales, amplitudes and noise maximise the
evidence (marginal likelihood).
"""
from __future__ import annotations

import numpy as np
import scipy

MOST = 120                     # values used for the hyperparameters. Chosen: the time grows with the cube
LENGTH, LENGTHS = 1.0, (-0.5, 3.5)  # log length scales over the states' standard deviation: prior mean; bounds. Chosen
SIZES, NOISES = (-5.0, 3.0), (-7.0, 0.0)  # bounds of the log amplitudes and of the log noise, over the values' RMS. Chosen
_LEAST = 1e-8  # variance added to the diagonal for conditioning


class VaryingFactors:
    """states: (N, D); features: (N, F); values: (N,); unsure: (N,) relative standard deviation of the noise.

    lengths: (D,) length scales in the states' units; dual: (N, F) weights for predictions.
    """

    def __init__(self, states: np.ndarray, features: np.ndarray, values: np.ndarray, unsure: np.ndarray):
        self._states, self._unsure, self._rms = states, unsure, max(float(np.sqrt(np.mean(values**2))), 1e-12)
        self._spread = np.maximum(states.std(axis=0), 1e-9)
        self._features, self._values = features / np.maximum(np.sqrt(np.mean(features**2, axis=0)), 1e-12), values / self._rms
        self._hyper = self._find()
        self._factor = scipy.linalg.cho_factor(self._covariance(self._hyper, slice(None)), lower=True)
        self._weights = scipy.linalg.cho_solve(self._factor, self._values)
        count = states.shape[1]
        self.lengths = self._spread * np.exp(self._hyper[:count])
        shares = np.exp(2 * self._hyper[count:-1]) / np.maximum(np.mean(features**2, axis=0), 1e-24)
        self.dual = self._rms * self._weights[:, None] * features * shares

    def left_out(self, groups: np.ndarray) -> np.ndarray:
        """(N,) prediction of each value from the other groups (leave-group-out)."""
        inverse = scipy.linalg.cho_solve(self._factor, np.eye(len(self._values)))
        predicted = np.zeros(len(groups))
        for group in np.unique(groups):
            held = groups == group
            predicted[held] = self._values[held] - np.linalg.solve(inverse[np.ix_(held, held)], self._weights[held])
        return predicted * self._rms

    def _covariance(self, hyper: np.ndarray, some) -> np.ndarray:
        count = self._states.shape[1]
        states, features = self._states[some] / self._spread / np.exp(hyper[:count]), self._features[some] * np.exp(hyper[count:-1])
        squares = np.sum(states**2, axis=1)
        near = np.exp(np.minimum(states @ states.T - (squares[:, None] + squares) / 2, 0.0))
        return near * (features @ features.T) + np.diag(np.exp(2 * hyper[-1]) * self._unsure[some]**2 + _LEAST)

    def _find(self) -> np.ndarray:
        count, factors = self._states.shape[1], self._features.shape[1]
        some = np.unique(np.linspace(0, len(self._values) - 1, min(MOST, len(self._values))).astype(int))

        def cost(hyper):
            """Negative log posterior of the hyperparameters."""
            try:
                lower = np.linalg.cholesky(self._covariance(hyper, some))
            except np.linalg.LinAlgError:
                return 1e10
            white = np.linalg.solve(lower, self._values[some])
            held = 0.5 * np.sum((hyper[:count] - LENGTH)**2) + 0.1 * np.sum(hyper[count:-1]**2)
            return 0.5 * white @ white + np.log(np.diag(lower)).sum() + held
        start = np.concatenate([np.full(count, LENGTH), np.zeros(factors), [-3.0]])
        return scipy.optimize.minimize(cost, start, method='L-BFGS-B', bounds=[LENGTHS] * count + [SIZES] * factors + [NOISES]).x

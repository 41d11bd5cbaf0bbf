# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the object moves, from the shear forces of the touched taxels."""
from __future__ import annotations

import numpy as np

_STEPS = np.array([0.05, 0.3, 30.0])  # standard deviations of noise by which shear changes in _STEP_S: at rest, over a texture, under load
_STEP_S = 0.01
_TEXTURE = 0.02  # part of the shear by which it changes in _STEP_S over a texture: friction varies by some percent within a millimetre
_UNCHANGED = np.log(0.05)  # of the probability that an object which moves changes no force in one frame: textures are uneven
_RATES = np.array([(0.0, 0.5, 0.5), (4.0, 0.0, 1.0), (4.0, 1.0, 0.0)])  # 1/s, of changes from row to column: a hand mostly holds still
_DIAGONAL = np.diag_indices(3)
_MIN_PROBABILITY = 1e-4  # probability of each, so that a change shows at once
_UNKNOWN = 1e6  # noise variances of a shear that is not known yet


class ShearMotion:
    """Three Kalman filters of the shear of each taxel, which differ in its random walk, with the probability of each for all taxels in
    common: interacting multiple models (Blom and Bar-Shalom 1988).

    Attributes
    ----------
    shear : ndarray, shape (N, 2)
        Filtered shear.
    variance : ndarray, shape (N, 2)
        Of its white noise.
    moving : float
        Probability that shear changes.
    """

    def __init__(self, count: int):
        self._mean, self._variance = np.zeros((3, count, 2)), np.full((3, count, 2), np.inf)
        self.shear, self.variance = np.zeros((count, 2)), np.zeros((count, 2))
        self.reset()

    def reset(self) -> None:
        """The next touch begins under load."""
        self._odds = np.array([0.0, 0.0, 1.0]) * (1 - 2 * _MIN_PROBABILITY) + _MIN_PROBABILITY
        self._odds /= self._odds.sum()
        self.moving = 0.0

    def update(self, shear: np.ndarray, noise: np.ndarray, members: np.ndarray, fresh: np.ndarray, is_new: np.ndarray,
               interval: float) -> None:
        """Take the shear (N, 2) of a frame, with its white noise (N, 2); members: touched taxels; fresh: (M,) which of these are new;
        is_new: (M,) whose reading is not repeated."""
        now, white = shear[members], noise[members]
        mixing = _RATES * min(interval, 0.1)
        mixing[_DIAGONAL] = 1 - mixing.sum(axis=1)
        arriving = self._odds @ mixing
        mixing *= self._odds[:, None] / arriving
        means, spreads = self._mean[:, members], self._variance[:, members]
        if fresh.any():
            means[:, fresh], spreads[:, fresh] = now[fresh], _UNKNOWN * white[fresh]
        shape = means.shape
        mean = (mixing.T @ means.reshape(3, -1)).reshape(shape)
        square = (mixing.T @ (spreads + means * means).reshape(3, -1)).reshape(shape)
        prior = np.maximum(square - mean * mean, 0.0) + (_STEPS**2 * (interval / _STEP_S))[:, None, None] * white
        prior[1] += _TEXTURE**2 * (interval / _STEP_S) * (now * now).sum(axis=1, keepdims=True)
        total = prior + white
        error = now - mean
        known = is_new & ~fresh
        evidence = -0.5 * (error * error / total + np.log(total))[:, known].sum(axis=(1, 2)) if known.any() else np.zeros(3)
        if known.any():
            evidence[1:] = np.logaddexp(evidence[1:], evidence[0] + _UNCHANGED)
        odds = arriving * np.exp(evidence - evidence.max())
        odds = odds / odds.sum() + _MIN_PROBABILITY
        self._odds = odds / odds.sum()
        gain = np.where((is_new | fresh)[:, None], prior / total, 0.0)
        means, spreads = mean + gain * error, (1 - gain) * prior
        self._mean[:, members], self._variance[:, members] = means, spreads
        self.shear[members] = (self._odds @ means.reshape(3, -1)).reshape(shape[1:])
        self.variance[members] = (self._odds @ spreads.reshape(3, -1)).reshape(shape[1:])
        self.moving = 1.0 - float(self._odds[0])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An offset that drifts: Kalman filters of constant drift, one for each of some accelerations, weighted by how well they predict.

A calm room then gives the mean over seconds, a room whose light changes the line through the last samples, and both go on while something
touches and nothing is measured (multiple models: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking, section 11.6).
A room whose light changes in strength moves the four outputs together, in a direction that is at first taken from what they are, and then
from how they change: the dark voltages of the amplifiers do not change with the light. Across that direction they rest.
The filters are therefore weighted for both apart.
"""
from __future__ import annotations

import math

import numpy as np

# 1/sqrt(s): changes of the drift within a second, as parts of the fastest. Chosen on simulated rooms that are calm, and that drift by 0.1 V
# within seconds: more filters between them tell no better
_ACCELERATIONS = np.array([0.01, 0.3])
_MEMORY_S = 5.0  # s in which the weights forget. Chosen: some touches
# Standard deviation of the drift beforehand, as part of the fastest, of each filter. Chosen on such rooms: a calm one is known as calm from
# its first second on
_FIRST_DRIFTS = np.array([0.03, 0.3])
_BASE_S, _LEARNT_S = 5.0, 20.0  # s: changes are those from the mean of the first, and are remembered for the second. Chosen
_FIRST_WEIGHT = 3e-4  # V^2 s: squared changes, over their time, that tell as much as the first direction. Chosen: a tenth is as good


class DriftFilter:
    """offset: (4,) V, of variance, V^2, each; fastest: V/s, fastest drift of an output. A copy goes on by itself."""

    def __init__(self, offset: np.ndarray, variance: float, fastest: float):
        count = len(_ACCELERATIONS)
        self._noise, self._fastest = (_ACCELERATIONS * fastest) ** 2, fastest
        self._score = np.zeros((2, count))  # along the room's light, and across; the largest is 0
        self._weigh()
        self._offsets = np.tile(offset, (count, 1))
        self._first = self._room = _unit(offset)
        self._base, self._changes = offset, np.zeros(4)
        self.restart(variance)

    def restart(self, variance: float) -> None:
        """The present offset has that variance, V^2, and its drift is not known."""
        self._drifts = np.zeros((len(self._noise), 4))
        self._spread = np.stack([np.diag([variance, drift**2]) for drift in _FIRST_DRIFTS * self._fastest])

    def _weigh(self) -> None:
        """Weights (2, filters) by how well each has predicted, along the room's light and across."""
        part = np.exp(self._score)
        self._weights = part / part.sum(axis=1, keepdims=True)
        self._more_along = self._weights[0] - self._weights[1]

    @property
    def offset(self) -> np.ndarray:
        """(4,) V at the present time."""
        return self._weights[1] @ self._offsets + (self._more_along @ (self._offsets @ self._room)) * self._room

    @property
    def variances(self) -> tuple[float, float]:
        """V^2, of the offset along the room's light, and of each output's across."""
        along, across = (self._weights @ self._spread[:, 0, 0]).tolist()
        return along, across

    def move(self, change: np.ndarray) -> None:
        """Add (4,) V."""
        self._offsets, self._base = self._offsets + change, self._base + change

    def predict(self, seconds: float) -> None:
        """Let the offset drift for some seconds."""
        step = np.array([[1, seconds], [0, 1]])
        noise = np.array([[seconds**3 / 3, seconds**2 / 2], [seconds**2 / 2, seconds]])
        self._offsets = self._offsets + seconds * self._drifts
        self._spread = step @ self._spread @ step.T + self._noise[:, None, None] * noise

    def correct(self, change: np.ndarray, variance: float, seconds: float) -> None:
        """The offset was by change (4,), V, higher in the mean of the seconds from now on, with variance, V^2, of each output."""
        measured = self.offset + change
        self.predict(seconds)
        innovation = measured - (self._offsets - 0.5 * seconds * self._drifts)
        expected = self._spread[:, 0, 0] + variance
        gain = self._spread[:, 0] / expected[:, None]
        along, log = (innovation @ self._room) ** 2, np.log(expected)
        across = np.einsum('ij,ij->i', innovation, innovation) - along
        score = self._score * math.exp(-seconds / _MEMORY_S) - 0.5 * np.stack([along / expected + log, across / expected + 3 * log])
        self._score = score - score.max(axis=1, keepdims=True)
        self._weigh()
        self._offsets = self._offsets + gain[:, :1] * innovation
        self._drifts = self._drifts + gain[:, 1:] * innovation
        self._spread = self._spread - gain[:, :, None] * self._spread[:, :1]
        self._learn(seconds)

    def _learn(self, seconds: float) -> None:
        """The direction in which the room's light changes, from how the offset has changed of late."""
        change = self.offset - self._base
        self._base = self._base + (1 - math.exp(-seconds / _BASE_S)) * change
        self._changes = self._changes * math.exp(-seconds / _LEARNT_S) + seconds * (change @ self._room) * change
        self._room = _unit(_FIRST_WEIGHT * self._first + self._changes)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pressure from a taxel's change of value: a gain for each taxel and a common curve."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .._core import taxel_pressure
from ..errors import BadArgument, BadCalibration
from .hysteresis import Loop

_KNEE = 0.05  # of the largest calibrated change, below which pressure may rise faster (a sensor with a dead zone). Chosen
_FEWEST = 3  # loads. Chosen: one for each coefficient of the curve
_SMALL = 0.3  # of the largest force, added to each force in the weights: relative error of large forces, absolute of small ones. Chosen
_REACHED = 0.95  # part of the taxels that an even load must reach. Chosen
_RESPONDING = 0.3  # of the mean change, from which a taxel is reached. Chosen: below the least gain
_LOADED = 0.05  # of the largest mean change, from which a frame is used for gains. Chosen
_GAINS = (0.5, 2.0)  # plausible range; a taxel outside it keeps gain 1. Chosen


@dataclass(frozen=True)
class Response:
    """pressure = scale[0] c + scale[1] c |c| + scale[2] c knee / (|c| + knee), Pa, of a change c of the value over the taxel's gain.

    gain: (rows, columns), mean about 1, None for 1; zero: (rows, columns) untouched values, None if unknown; known: whether pressure is in
    Pa, else in the sensor's units; loop: between rising and falling loads. Raises BadArgument for a scale with which pressure would not
    rise.
    """

    scale: tuple[float, float, float] = (1.0, 0.0, 0.0)
    knee: float = 1.0
    gain: np.ndarray | None = None
    known: bool = False
    zero: np.ndarray | None = None
    loop: Loop = Loop()

    def __post_init__(self):
        if not (len(self.scale) == 3 and np.isfinite(self.scale).all() and min(self.scale) >= 0 and any(self.scale) and self.knee > 0):
            raise BadArgument(f'taxel response: scale must be three finite numbers, none negative and not all 0, and knee positive, got '
                              f'{self.scale}, {self.knee}')

    @cached_property
    def _by_gain(self) -> np.ndarray | None:
        return None if self.gain is None else (1 / self.gain).astype(np.float32)

    def pressure(self, change: np.ndarray) -> np.ndarray:
        """Pressure (rows, columns) float32, Pa if known, for change (rows, columns) of the values."""
        by_gain = np.ones(change.shape, np.float32) if self._by_gain is None else self._by_gain
        return taxel_pressure(np.asarray(change, np.float32), by_gain, scale=self.scale, knee=self.knee)

    def slope(self, value: float) -> float:
        """Derivative of pressure, Pa per unit, at a change of value."""
        first, second, third = self.scale
        return first + 2 * second * abs(value) + third * (self.knee / (abs(value) + self.knee))**2


def curve_terms(value: np.ndarray, knee: float) -> np.ndarray:
    """(3, ...) terms that scale multiplies."""
    size = np.abs(value)
    return np.stack([value, value * size, value * knee / (size + knee)])


def fit_gains(changes: np.ndarray) -> np.ndarray | None:
    """Gains (rows, columns), mean about 1, from changes (N, rows, columns) under even loads; None with fewer than 3 even loads."""
    mean = changes.mean(axis=(1, 2))
    even = mean > _LOADED * max(float(mean.max(initial=0.0)), 1e-9)
    spread = (changes > _RESPONDING * mean[:, None, None]).mean(axis=(1, 2))
    even &= spread > _REACHED
    if even.sum() < _FEWEST:
        return None
    gains = np.einsum('n,nij->ij', mean[even], changes[even]) / np.sum(mean[even]**2)
    return np.where((gains > _GAINS[0]) & (gains < _GAINS[1]), gains, 1.0).astype(np.float32)


def force_terms(changes: np.ndarray, taxel_area: float, gain: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """What scale multiplies in the forces (N,) of changes (N, rows, columns), (N, 3), and the curve's knee; see fit_response."""
    value = (changes if gain is None else changes / gain).reshape(len(changes), -1).astype(float)
    knee = _KNEE * float(value.max(initial=0))
    return taxel_area * curve_terms(value, max(knee, 1e-12)).sum(axis=2).T, knee


def fit_response(changes: np.ndarray, forces: np.ndarray, taxel_area: float,
                 gain: np.ndarray | None = None) -> tuple[Response, np.ndarray]:
    """Nonnegative least squares fit of the response to normal forces (N,), N, with changes (N, rows, columns), and its predictions (N,), N.

    taxel_area: m^2; gain: (rows, columns). Forces that are NaN or not positive are skipped. Raises BadCalibration where the loads do not
    determine the response.
    """
    forces = np.asarray(forces, float)
    known = np.isfinite(forces) & (forces > 0)
    if np.unique(np.round(forces[known], 6)).size < _FEWEST:
        raise BadCalibration(f'normal force: {np.unique(np.round(forces[known], 6)).size} different loads; at least {_FEWEST} are needed')
    rows, knee = force_terms(changes, taxel_area, gain)
    if not (rows[known, 0] > 0).all():
        raise BadCalibration('normal force: the sensor does not respond to some of the loads')
    unit = rows[known].mean(axis=0)
    weight = forces[known] + _SMALL * forces[known].max()
    from scipy.optimize import nnls  # calibration alone needs it
    scale = nnls(rows[known] / unit / weight[:, None], forces[known] / weight)[0] / unit
    return Response(tuple(float(s) for s in scale), knee, gain, True), rows @ scale

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a taxel's change of value to pressure: each taxel's gain, and the curve that they share."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import BadArgument, BadCalibration

_KNEE = 0.05  # of the largest change that was calibrated: under it pressure may rise faster, as over a sensor that wakes up late
_FEWEST = 3  # loads
_SMALL = 0.3  # of the largest force: what is smaller counts by its absolute error
_REACHED = 0.95  # share of the taxels that a load on all of them must reach
_LOADED = 0.05  # of the largest mean change: less tells nothing of gains
_GAINS = (0.5, 2.0)  # a taxel beyond these is not believed, and keeps 1


@dataclass(frozen=True)
class Response:
    """pressure = scale[0] c + scale[1] c |c| + scale[2] c knee / (|c| + knee), Pa, of a change c of the value over the taxel's gain.

    gain: (rows, columns) about 1, None for 1; zero: (rows, columns) values while nothing touches, None where they are not known; known:
    whether the pressure is in Pa, or in the sensor's own units. Raises BadArgument for a scale under which pressure would not rise.
    """

    scale: tuple[float, float, float] = (1.0, 0.0, 0.0)
    knee: float = 1.0
    gain: np.ndarray | None = None
    known: bool = False
    zero: np.ndarray | None = None

    def __post_init__(self):
        if not (len(self.scale) == 3 and np.isfinite(self.scale).all() and min(self.scale) >= 0 and any(self.scale) and self.knee > 0):
            raise BadArgument(f'taxel response: scale must be three finite numbers, none negative and not all 0, and knee positive, got '
                              f'{self.scale}, {self.knee}')

    @cached_property
    def _by_gain(self) -> np.ndarray | np.float32:
        return np.float32(1) if self.gain is None else (1 / self.gain).astype(np.float32)

    def pressure(self, change: np.ndarray) -> np.ndarray:
        """(rows, columns) float32, Pa where known, of change (rows, columns) float32 of the values."""
        value = change * self._by_gain
        first, second, third = np.float32(self.scale)
        if not (second or third):
            return value * first
        size, knee = np.abs(value), np.float32(self.knee)
        return value * (first + second * size + third * knee / (size + knee))

    def slope(self, value: float) -> float:
        """Pa for each unit of change at a change of value."""
        first, second, third = self.scale
        return first + 2 * second * abs(value) + third * (self.knee / (abs(value) + self.knee))**2


def _terms(value: np.ndarray, knee: float) -> np.ndarray:
    """(3, ...) what the scale multiplies."""
    size = np.abs(value)
    return np.stack([value, value * size, value * knee / (size + knee)])


def fit_gains(changes: np.ndarray) -> np.ndarray | None:
    """(rows, columns) about 1 from changes (N, rows, columns) under loads that all taxels share evenly; None where none is such."""
    mean = changes.mean(axis=(1, 2))
    even = mean > _LOADED * max(float(mean.max(initial=0.0)), 1e-9)
    spread = (changes > 0.3 * mean[:, None, None]).mean(axis=(1, 2))
    even &= spread > _REACHED
    if even.sum() < _FEWEST:
        return None
    gains = np.einsum('n,nij->ij', mean[even], changes[even]) / np.sum(mean[even]**2)
    return np.where((gains > _GAINS[0]) & (gains < _GAINS[1]), gains, 1.0).astype(np.float32)


def fit_response(changes: np.ndarray, forces: np.ndarray, taxel_area: float,
                 gain: np.ndarray | None = None) -> tuple[Response, np.ndarray]:
    """The response that predicts normal forces (N,) N, positive, from changes (N, rows, columns) with the least sum of squared relative
    errors, and the forces (N,) that it predicts. Raises BadCalibration where the loads do not determine it.
    """
    forces = np.asarray(forces, float)
    known = np.isfinite(forces) & (forces > 0)
    if np.unique(np.round(forces[known], 6)).size < _FEWEST:
        raise BadCalibration(f'normal force: {np.unique(np.round(forces[known], 6)).size} different loads; at least {_FEWEST} are needed')
    value = np.maximum(changes if gain is None else changes / gain, 0).reshape(len(changes), -1).astype(float)
    knee = _KNEE * float(value.max())
    if not (value[known].sum(axis=1) > 0).all():
        raise BadCalibration('normal force: the sensor shows nothing under some of the loads')
    rows = taxel_area * _terms(value, knee).sum(axis=2).T
    unit = rows[known].mean(axis=0)
    weight = forces[known] + _SMALL * forces[known].max()
    from scipy.optimize import nnls  # calibration alone needs it
    scale = nnls(rows[known] / unit / weight[:, None], forces[known] / weight)[0] / unit
    return Response(tuple(float(s) for s in scale), knee, gain, True), rows @ scale

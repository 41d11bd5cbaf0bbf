# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a taxel's change of value to pressure: each taxel's gain, and the curve that they share."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import nnls

from ..errors import BadArgument, BadCalibration

TERMS = 2
_FEWEST = 3  # loads
_REACHED = 0.95  # share of the taxels that a load on all of them must reach
_LOADED = 0.05  # of the largest mean change: less tells nothing of gains
_GAINS = (0.5, 2.0)  # a taxel beyond these is not believed, and keeps 1


@dataclass(frozen=True)
class Response:
    """pressure = scale[0] change + scale[1] change^2, Pa, with change / gain in place of change; gain: (rows, columns) about 1, or 1.

    unit: the same in the sensor's own units where the pressure is not known: scale (1, 0), known False.
    """

    scale: tuple[float, float] = (1.0, 0.0)
    gain: np.ndarray | None = None
    known: bool = False
    zero: np.ndarray | None = field(default=None)

    def __post_init__(self):
        if not (len(self.scale) == TERMS and np.isfinite(self.scale).all() and self.scale[0] >= 0 and any(self.scale)):
            raise BadArgument(f'taxel response: scale must be two finite numbers, the first not negative, got {self.scale}')

    def pressure(self, change: np.ndarray) -> np.ndarray:
        """(rows, columns) float32, Pa where known, of change (rows, columns) float32 of the values."""
        value = change if self.gain is None else change / self.gain
        first, second = self.scale
        return value * np.float32(first) + (np.float32(second) * value * np.abs(value) if second else 0)


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
                 gain: np.ndarray | None = None) -> tuple[tuple[float, float], np.ndarray]:
    """The scale that predicts normal forces (N,) N, positive, from changes (N, rows, columns), with the least sum of squared relative
    errors, and the predicted forces (N,). The curve rises everywhere. Raises BadCalibration where the loads do not determine it.
    """
    forces = np.asarray(forces, float)
    known = np.isfinite(forces) & (forces > 0)
    if np.unique(np.round(forces[known], 6)).size < _FEWEST:
        raise BadCalibration(f'normal force: {np.unique(np.round(forces[known], 6)).size} different loads; at least {_FEWEST} are needed')
    value = np.maximum(changes if gain is None else changes / gain, 0).reshape(len(changes), -1).astype(float)
    rows = taxel_area * np.stack([value.sum(axis=1), (value**2).sum(axis=1)], axis=1)
    if not (rows[known, 0] > 0).all():
        raise BadCalibration('normal force: the sensor shows nothing under some of the loads')
    unit = rows[known].mean(axis=0)
    scale = nnls(rows[known] / unit / forces[known, None], np.ones(known.sum()))[0] / unit
    return (float(scale[0]), float(scale[1])), rows @ scale

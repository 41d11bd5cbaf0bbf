# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Online estimate of the scale error that all measured ranges share: displacements along the rays read a few percent too large or small.

The untouched pad does not determine this factor. A wrong factor makes a dented surface too deep or too flat for the dots' image positions;
the membrane's tension is then out of balance along the surface, at all dots alike. A Gauss-Newton step towards the factor of best balance
is made in every third frame, and less often once a step adds little information.
"""
from __future__ import annotations

import numpy as np

from ...common.vectors import dot
from .step import MembraneFrame

_EVERY, _SELDOM = 3, 12  # frames between updates; chosen: an update costs two evaluations of the forces
_WELL, _LITTLE = 0.02, 0.1  # chosen: updates are rare once sigma is below the first and one adds less than the second of the information
_FAR_ENOUGH, _FAR_SHARE = 0.5e-3, 0.02  # m; chosen: update only while more than this share of the dots is displaced by more
_TRIAL = 0.01  # relative step of the finite difference; chosen
# Standard deviation of a free dot's tangential residual (over the fluid's pressure) from other causes, and the number of dots and frames
# over which such a cause is correlated; chosen.
_RESIDUAL, _CORRELATED = 0.2, 25.0
_FINEST = 0.008  # smallest standard deviation; chosen for the mesh's discretisation error
_LARGEST = 0.2  # largest factor and step; chosen


class RangeScale:
    """Factor 1 + value on displacements along the rays; sigma: prior standard deviation of value (0: value is fixed)."""

    def __init__(self, sigma: float = 0.05, value: float = 0.0):
        self.value, self.sigma = value, sigma
        self._precision = 1 / sigma**2 if sigma > 0 else np.inf
        self._frames, self._every = 0, _EVERY

    def correct(self, ranges: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Measured ranges (N,), m, with the factor on their difference from the ranges at rest (N,)."""
        return rest + (1 + self.value) * (ranges - rest)

    def learn(self, frame: MembraneFrame, rest: np.ndarray) -> None:
        """Update the factor from a solved frame; rest: (K,) m, ranges of all dots at rest."""
        if self._precision == np.inf:
            return
        self._frames += 1
        if self._frames < self._every:
            return
        self._frames = 0
        gone = np.where(frame.weight > 0, frame.measured - rest, 0.0)
        if np.count_nonzero(np.abs(gone) > _FAR_ENOUGH) <= _FAR_SHARE * len(gone):
            return
        moved, lifted = frame.answer(gone / (1 + self.value))
        here = _along_surface(*frame.forces.evaluate(frame.places, frame.pressure), frame.pressure)
        pressure = frame.pressure + _TRIAL * lifted
        there = _along_surface(*frame.forces.evaluate(frame.places + _TRIAL * moved * frame.rays, pressure), pressure)
        slope = (there - here) / _TRIAL
        calm = (frame.touched + frame.mesh.neighbour_mean(frame.touched) < .05) & frame.mesh.inner
        weight = calm / (1 + (here**2).sum(0) / (2 * _RESIDUAL)**2)**2
        curvature = (weight * slope**2).sum()
        information = curvature / _RESIDUAL**2 / _CORRELATED * (self._every / _EVERY)
        if information > 0:
            best = -(weight * slope * here).sum() / curvature
            self._precision = min(self._precision + information, 1 / _FINEST**2)
            share = information / self._precision
            self.value = min(max(float(self.value + share * min(max(best, -_LARGEST), _LARGEST)), -_LARGEST), _LARGEST)
            self._every = _SELDOM if share < _LITTLE and self._precision > 1 / _WELL**2 else _EVERY


def _along_surface(force: np.ndarray, share: np.ndarray, pressure: float) -> np.ndarray:
    """Tangential part (3, K), over the fluid's pressure, of residual forces (3, K) on dots with area vectors share (3, K)."""
    square = dot(share, share)
    return (force - (dot(force, share) / square) * share) / (pressure * np.sqrt(square))

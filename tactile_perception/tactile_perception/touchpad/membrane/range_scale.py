# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The one error that all measured ranges share, learnt in use: displacements along the rays read a few percent too large or too small.

Colour tells how far a dot has gone but for a factor that the untouched pad cannot show. A wrong factor makes a dented surface too deep or
too flat for the dots' places in the image, and then the membrane's tension is out of balance along the surface, dot by dot the same way.
The factor that balances it best is sought a little in every third frame, and less often once that adds little to what is known of it.
"""
from __future__ import annotations

import numpy as np

from ...common.vectors import dot
from .state import MembraneState
from .step import MembraneFrame

_EVERY, _SELDOM = 3, 12
# Standard deviation from which on it is known well, and share of what is known of it that is little to add.
_WELL, _LITTLE = 0.02, 0.1
# m: where only this share of the dots have gone as far along their rays, the factor shows too little.
_FAR_ENOUGH, _FAR_SHARE = 0.5e-3, 0.02
_TRIAL = 0.01
# What free dots have left over along the surface (of the fluid's pressure) for other reasons, and how many dots and frames share one such
# reason.
_LEFT_OVER, _SHARED = 0.2, 25.0
# The mesh's own error: nothing is learnt beyond it.
_FINEST = 0.008
_LARGEST = 0.2


class RangeScale:
    """Factor 1 + value on displacements along the rays; sigma: standard deviation expected of it before anything has touched (0: it is
    known)."""

    def __init__(self, sigma: float = 0.05, value: float = 0.0):
        self.value, self.sigma = value, sigma
        self._precision = 1 / sigma**2 if sigma > 0 else np.inf
        self._frames, self._every = 0, _EVERY

    def correct(self, ranges: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Measured ranges (N,), m, with the factor on how far they are from those at rest (N,)."""
        return rest + (1 + self.value) * (ranges - rest)

    def learn(self, frame: MembraneFrame, state: MembraneState, rest: np.ndarray):
        """Take account of a solved frame and what came of it; rest: (K,) m, ranges of all dots at rest."""
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
        here = _along_surface(*state.balance, state.fluid_pressure)
        pressure = state.fluid_pressure + _TRIAL * lifted
        there = _along_surface(*state.forces.evaluate(state.places + _TRIAL * moved * frame.rays, pressure), pressure)
        slope = (there - here) / _TRIAL
        calm = (frame.touched + frame.mesh.neighbour_mean(frame.touched) < .05) & frame.mesh.inner
        weight = calm / (1 + (here**2).sum(0) / (2 * _LEFT_OVER)**2)**2
        curvature = (weight * slope**2).sum()
        information = curvature / _LEFT_OVER**2 / _SHARED * (self._every / _EVERY)
        if information > 0:
            best = -(weight * slope * here).sum() / curvature
            self._precision = min(self._precision + information, 1 / _FINEST**2)
            share = information / self._precision
            self.value = min(max(float(self.value + share * min(max(best, -_LARGEST), _LARGEST)), -_LARGEST), _LARGEST)
            self._every = _SELDOM if share < _LITTLE and self._precision > 1 / _WELL**2 else _EVERY


def _along_surface(force: np.ndarray, share: np.ndarray, pressure: float) -> np.ndarray:
    """What is left over along the surface (3, K), of the fluid's pressure, of a balance: force (3, K), share (3, K)."""
    square = dot(share, share)
    return (force - (dot(force, share) / square) * share) / (pressure * np.sqrt(square))

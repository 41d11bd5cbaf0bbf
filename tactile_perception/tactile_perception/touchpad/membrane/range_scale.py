# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Online estimate of the scale error that all measured ranges share: displacements along the rays read a few percent too large or small.

The untouched pad does not determine this factor. A wrong factor makes a dented surface too deep or too flat for the dots' image positions;
the membrane's tension is then out of balance along the surface, at all dots alike. A Gauss-Newton step towards the factor of best balance
is made in every frame.
"""
from __future__ import annotations

import numpy as np

from .forces import MembraneForces
from .state import MembraneState

_FAR_ENOUGH, _FAR_SHARE = 0.5e-3, 0.02  # m; chosen: update only while more than this share of the dots is displaced by more
_TRIAL = 0.01  # relative step of the finite difference; chosen
# Standard deviation of a free dot's tangential residual (over the fluid's pressure) from other causes, and the number of dots and frames
# over which such a cause is correlated; chosen.
_RESIDUAL, _CORRELATED = 0.2, 50.0
_FINEST = 0.008  # smallest standard deviation; chosen for the mesh's discretisation error
_LARGEST = 0.2  # largest factor and step; chosen


class RangeScale:
    """Factor 1 + value on displacements along the rays; sigma: prior standard deviation of value (0: value is fixed)."""

    def __init__(self, sigma: float = 0.05, value: float = 0.0):
        self.value, self.sigma = value, sigma
        self._precision = 1 / sigma**2 if sigma > 0 else np.inf

    @property
    def factor(self) -> float:
        """Factor on measured ranges less those at rest."""
        return 1 + self.value

    def learn(self, forces: MembraneForces, state: MembraneState, rays: np.ndarray, displaced: np.ndarray, moved: np.ndarray,
              lifted: float) -> None:
        """Update the factor from a solved frame.

        rays: (K, 3) unit; displaced: (K,) m, measured ranges less those at rest; moved: (K,) m, lifted: Pa, what ranges and pressure would
        change by if all were displaced twice as far.
        """
        if self._precision == np.inf:
            return
        if np.count_nonzero(np.abs(displaced) > _FAR_ENOUGH) <= _FAR_SHARE * len(displaced):
            return
        curvature, gradient = forces.scale_leaning(state, rays, moved, lifted, step=_TRIAL, spread=_RESIDUAL, scale=self.factor)
        information = curvature / _RESIDUAL**2 / _CORRELATED
        if information > 0:
            best = -gradient / curvature
            self._precision = min(self._precision + information, 1 / _FINEST**2)
            share = information / self._precision
            self.value = min(max(float(self.value + share * min(max(best, -_LARGEST), _LARGEST)), -_LARGEST), _LARGEST)

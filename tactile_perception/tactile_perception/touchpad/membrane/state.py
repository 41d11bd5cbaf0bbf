# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The membrane in one frame: where all dots are, and the loads that follow from it."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...common.vectors import dot
from .forces import MembraneForces


@dataclass
class MembraneState:
    """All K dots of the grid in the order of their numbers (unseen ones as the membrane has them). The loads are worked out when asked for.

    forces: of the membrane; places: (3, K) m, sensor frame; ranges: (K,) m from the camera's centre; touched: (K,) probability that the dot
    carries a load; fluid_pressure: Pa; seen: (K,) bool.
    """

    forces: MembraneForces
    places: np.ndarray
    ranges: np.ndarray
    touched: np.ndarray
    fluid_pressure: float
    seen: np.ndarray

    @property
    def xyz(self) -> np.ndarray:
        """(K, 3) m, sensor frame."""
        return self.places.T

    @cached_property
    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """What is left over on each dot (3, K), N, and its area vector (3, K), m^2."""
        return self.forces.evaluate(self.places, self.fluid_pressure)

    @property
    def force(self) -> np.ndarray:
        """(K, 3) N, of the object on the sensor at each dot: its share of the surface. The outermost dots, which have no balance, are 0."""
        return np.where(self.forces.mesh.inner, -self.balance[0], 0.0).T

    @property
    def load(self) -> np.ndarray:
        """(K,) normal pressure of the object over the fluid's: 0 free, 1 under a flat face."""
        force, share = self.balance
        return np.where(self.forces.mesh.inner, dot(force, share) / (self.fluid_pressure * dot(share, share)), 0.0)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Spherical cap, the rest shape of touchpad (paper touchpad_contact_region, section 2) and dome; intersection of rays and sphere."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BadArgument


@dataclass(frozen=True)
class Cap:
    """A spherical cap over the rim plane z = 0: curvature_radius and height in m; the sphere's centre lies on the z axis."""

    curvature_radius: float = 0.020
    height: float = 0.013

    def __post_init__(self):
        if not 0 < self.height <= 2 * self.curvature_radius < np.inf:
            raise BadArgument(f'cap: need 0 < height <= 2 curvature_radius, got height {self.height} m, radius {self.curvature_radius} m')

    @property
    def centre_z(self) -> float:
        """Height of the sphere's centre over the rim plane, m."""
        return self.height - self.curvature_radius

    @property
    def rim_radius(self) -> float:
        """Radius of the clamped rim, m."""
        return float(np.sqrt(self.curvature_radius**2 - self.centre_z**2))

    def ranges(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Distances (N,), m, from origin (3,) or (N, 3) along unit rays (N, 3) to the far side of the sphere; NaN where a ray misses it."""
        return sphere_ranges(origin, rays, np.array([0.0, 0.0, self.centre_z]), self.curvature_radius)[1]

    def meet(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Points (N, 3), m, where unit rays (N, 3) from origin (3,) or (N, 3) meet the cap from inside; NaN where a ray misses it."""
        return origin + self.ranges(origin, rays)[:, None] * rays

    def heights(self, xy: np.ndarray) -> np.ndarray:
        """Heights (N,) of the rest shape over the rim plane at xy (N, 2), m; NaN beyond the sphere."""
        inside = self.curvature_radius**2 - np.sum(np.square(xy), axis=1)
        return self.centre_z + np.sqrt(np.where(inside >= 0, inside, np.nan))


def sphere_ranges(origin: np.ndarray, rays: np.ndarray, centre: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances (N,), m, along unit rays (N, 3) to the near and to the far side of a sphere; NaN where a ray misses it.

    origin: (3,), or one for each ray (N, 3), m; centre: (3,) m.
    """
    offset = origin - centre
    along = rays @ offset if offset.ndim == 1 else np.einsum('ij,ij->i', rays, offset)
    inside = along**2 - np.einsum('...i,...i->...', offset, offset) + radius**2
    half_chord = np.sqrt(np.where((inside >= 0) & (inside < np.inf), inside, np.nan))
    return -along - half_chord, half_chord - along

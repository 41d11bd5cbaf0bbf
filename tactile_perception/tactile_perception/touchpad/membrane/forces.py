# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodal forces in a stretched membrane: elastic (incompressible neo-Hookean) and of the fluid behind it.

With the rest tension T0 = p0 R / 2 (Young-Laplace), the energy of a triangle of area A (A0 at rest) is G/2 (tr C + a (A0/A)^2) A0 with
a = 1 - T0/G: the first term is the cotangent Laplacian of the rest shape (springs with constant weights), the second depends on the area
alone. Bending is neglected: its length scale sqrt(B/T), 0.3 mm, is far below a pitch.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from ...errors import BadArgument
from .mesh import GridMesh
from .state import MembraneState


@dataclass(frozen=True)
class MembraneMaterial:
    """shear_stiffness: shear modulus times thickness, N/m; rest_pressure: gauge pressure of the fluid without contact, Pa;
    rest_curvature_radius: m.

    Raises BadArgument for a rest tension p R / 2 above shear_stiffness, which a neo-Hookean membrane cannot carry.
    """

    shear_stiffness: float = 90.0
    rest_pressure: float = 2000.0
    rest_curvature_radius: float = 0.020

    def __post_init__(self):
        if not (self.shear_stiffness > 0 and self.rest_pressure > 0 and 0 < self.rest_tension <= self.shear_stiffness):
            raise BadArgument(f'membrane: shear_stiffness {self.shear_stiffness} N/m, rest_pressure {self.rest_pressure} Pa and curvature '
                              f'radius {self.rest_curvature_radius} m need 0 < pressure * radius / 2 <= stiffness; check membrane.*')

    @property
    def rest_tension(self) -> float:
        """Tension at rest, N/m."""
        return self.rest_pressure * self.rest_curvature_radius / 2


class MembraneForces:
    """Nodal forces of a mesh with rest positions rest_xyz (K, 3), m.

    triangles: the kernels' description of the membrane at rest; rest_residual: (K, 3) m^2, the mesh's discretisation error at rest over
    the pressure, which is subtracted.
    """

    def __init__(self, mesh: GridMesh, rest_xyz: np.ndarray, material: MembraneMaterial):
        self.mesh, self.material = mesh, material
        self._grid = {'rows': mesh.rows, 'columns': mesh.columns}
        rest = np.ascontiguousarray(rest_xyz, float)
        self.triangles = _core.membrane_at_rest(rest, stiffness=material.shear_stiffness,
                                                area_share=1 - material.rest_tension / material.shear_stiffness, **self._grid)
        elastic, share = self.elastic(rest)
        self.rest_residual = share + elastic / material.rest_pressure

    def elastic(self, xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force of the membrane alone on each dot (K, 3), N, and the dots' area vectors (K, 3), m^2, at places xyz (K, 3), m."""
        return _core.membrane_forces(xyz, self.triangles, **self._grid)

    def slopes(self, xyz: np.ndarray, rays: np.ndarray, pressure: float) -> np.ndarray:
        """(K, 9) 1/m, in stencil order: derivatives of the normal load over pressure, Pa, by movements of the dots at xyz (K, 3) along
        their unit rays (K, 3), normals held."""
        return _core.membrane_slopes(xyz, rays, self.triangles, self.rest_residual, pressure=pressure, **self._grid)

    def scale_leaning(self, state: MembraneState, rays: np.ndarray, moved: np.ndarray, lifted: float,
                      **numbers: float) -> tuple[float, float]:
        """Sums of r'^2 and r r' over free dots, r: residual force along the surface over the pressure, r': its derivative by the scale.

        state: of the frame, along unit rays (K, 3); moved: (K,) m, lifted: Pa, as of RangeScale.learn; numbers: step of the scale, spread
        of a free dot's r, scale. Kernel: src/touchpad/membrane/membrane_frame.cpp.
        """
        return _core.scale_leaning(state.xyz, rays, state.touched, moved, self.triangles, self.rest_residual, lifted=lifted,
                                   pressure=state.fluid_pressure, **numbers, **self._grid)

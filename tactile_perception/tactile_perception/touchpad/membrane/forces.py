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

from .cells import MembraneCells
from ...common.vectors import cross, dot
from ...errors import BadArgument
from .mesh import GridMesh


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
    """Nodal forces of a mesh with rest positions rest_xyz (K, 3), m. Arrays are component first: (3, K) dots; (3, 3, T) component, corner,
    triangle."""

    def __init__(self, mesh: GridMesh, rest_xyz: np.ndarray, material: MembraneMaterial):
        self.mesh, self.material = mesh, material
        self.area_share = 1 - material.rest_tension / material.shear_stiffness
        rest = np.ascontiguousarray(rest_xyz.T, float)
        self.laplacian = self._laplacian(rest)
        self._cells = MembraneCells(mesh, self._edge_springs(), rest, material.shear_stiffness * self.area_share)
        self.rest_area = self._triangles(rest)[2]
        self.rest_residual = np.zeros_like(rest)
        self.rest_residual = self.evaluate(rest, material.rest_pressure)[0] / material.rest_pressure

    def _laplacian(self, rest: np.ndarray) -> np.ndarray:
        """Cotangent weights (9, K), negative off the diagonal, times the shear stiffness; each triangle counts half."""
        corner = rest[:, self.mesh.triangles]
        pairs = np.zeros((3, 3, corner.shape[2]))
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            u, v = corner[:, i] - corner[:, k], corner[:, j] - corner[:, k]
            weight = (u * v).sum(0) / np.linalg.norm(cross(u, v), axis=0) / 4
            pairs[i, j] -= weight
            pairs[j, i] -= weight
            pairs[i, i] += weight
            pairs[j, j] += weight
        return self.material.shear_stiffness * self.mesh.to_pairs(pairs)

    def _edge_springs(self) -> np.ndarray:
        """Weights (4, K), N/m, of the edges as MembraneCells takes them."""
        rising = np.zeros(self.mesh.size)
        rising[:-1] = self.laplacian[6, 1:]
        return -np.stack([self.laplacian[5], self.laplacian[7], self.laplacian[8], rising])

    def _triangles(self, x: np.ndarray):
        """Edge opposite to each corner (3, 3, T), area vector (3, T), area (T,)."""
        first, second, third = (x.take(k, axis=1) for k in self.mesh.triangles)
        edge = np.empty((3, 3, first.shape[1]))
        np.subtract(third, second, out=edge[:, 0])
        np.subtract(first, third, out=edge[:, 1])
        np.subtract(second, first, out=edge[:, 2])
        vector = cross(edge[:, 0], edge[:, 1]) / 2
        return edge, vector, np.sqrt(dot(vector, vector))

    def elastic(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force of the membrane alone on each dot (3, K), N, and the dots' area vectors (3, K), m^2, for places x (3, K)."""
        return self._cells.evaluate(x)

    def evaluate(self, x: np.ndarray, pressure: float) -> tuple[np.ndarray, np.ndarray]:
        """Residual force of membrane and fluid on each dot (3, K), N, which an object balances, and the dots' area vectors (3, K), m^2.

        x: (3, K) m, positions; pressure: Pa. The mesh's discretisation error at rest, proportional to the pressure, is subtracted.
        """
        elastic, share = self.elastic(x)
        pushed = share - self.rest_residual
        pushed *= pressure
        elastic += pushed
        return elastic, share

    def _stiffening(self, area: np.ndarray) -> np.ndarray:
        shrunk = self.rest_area / area
        return self.material.shear_stiffness * self.area_share / 2 * (shrunk * shrunk * shrunk)

    def balance(self, x: np.ndarray, pressure: float):
        """At positions x (3, K): normal residual (K,) N, its derivative by the pressure (K,) m^2, normals (3, K), areas (K,) m^2."""
        force, share = self.evaluate(x, pressure)
        area = np.sqrt(dot(share, share))
        normal = share / area
        return dot(force, normal), dot(share - self.rest_residual, normal), normal, area

    def slopes(self, x: np.ndarray, normal: np.ndarray, rays: np.ndarray, pressure: float) -> np.ndarray:
        """Derivatives (9, K) N/m, in stencil order, of the normal residual at positions x (3, K) by movements of the dots along their unit
        rays (3, K), normals (3, K) held."""
        springs = self.laplacian * dot(normal[:, None], rays.take(self.mesh.stencil, axis=1))
        return self.mesh.to_pairs(self._pair_derivatives(x, normal, rays, pressure)) - springs

    def along_rays(self, x: np.ndarray, rays: np.ndarray, pressure: float):
        """Residual, slopes (9, K), derivative by the pressure, normals and areas: balance and slopes at positions x (3, K)."""
        residual, by_pressure, normal, area = self.balance(x, pressure)
        return residual, self.slopes(x, normal, rays, pressure), by_pressure, normal, area

    def _pair_derivatives(self, x, dot_normal, rays, pressure):
        """(3, 3, T): derivative of the normal force at corner k by corner j's movement along its ray, of area term and fluid pressure.

        Single precision: only the direction of a step depends on it.
        """
        edge, vector, area = self._triangles(x)
        stiffening = self._stiffening(area)
        normal, per_area = (vector / area).astype(np.float32), (stiffening / area).astype(np.float32)
        edge, half = edge.astype(np.float32), (stiffening / 2).astype(np.float32)
        corner_normal = dot_normal.astype(np.float32).take(self.mesh.triangles, axis=1)
        ray = rays.astype(np.float32).take(self.mesh.triangles, axis=1)
        turned = cross(edge, corner_normal) / 2
        tilt = cross(corner_normal, normal[:, None])
        area_rate = cross(edge, ray) / 2
        # three from the derivative of 1/A^3, the fourth from the rotation of the triangle's normal
        along = -4 * dot(turned, normal[:, None])
        lever = per_area * turned + np.float32(pressure / 6) * corner_normal + (per_area * along) * normal[:, None]
        out = np.einsum('ckt,cjt->kjt', lever, area_rate)
        for k in range(3):
            before, after = (k + 2) % 3, (k + 1) % 3
            out[k, before] += half * dot(ray[:, before], tilt[:, k])
            out[k, after] -= half * dot(ray[:, after], tilt[:, k])
        return out

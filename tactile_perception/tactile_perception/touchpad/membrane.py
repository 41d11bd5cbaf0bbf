# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dot positions from measured ranges, regularised by the membrane's force balance.

Off contact the membrane's elastic force and the fluid's pressure cancel; in contact the residual is the object's pressure. Each dot is free
(residual: the mesh's discretisation error) or touched (residual: roughly the fluid's pressure): a mixture model with coupled neighbours,
solved by reweighted Gauss-Newton steps in the ranges, each one banded Cholesky solve. It assumes no object shape and no motion.

With the rest tension T0 = p0 R / 2 (Young-Laplace), the energy of a triangle of area A (A0 at rest) is G/2 (tr C + a (A0/A)^2) A0 with
a = 1 - T0/G (incompressible neo-Hookean): the first term is the cotangent Laplacian of the rest shape (springs with constant weights), the
second depends on the area alone. Bending is neglected: its length scale sqrt(B/T), 0.3 mm, is far below a pitch.

All displacements along the rays may share a scale error of a few percent, which the untouched pad does not determine. A wrong scale makes a
dented surface too deep or too flat for the dots' image positions; the tension is then out of balance along the surface, at all dots alike.
A Gauss-Newton step towards the scale of best balance is made in every frame.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..errors import BadArgument

_MOST = 4096  # dots, 64 x 64; chosen: no printed pad has more


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
        if not (self.shear_stiffness > 0 and self.rest_pressure > 0 and 0 < self.rest_tension <= (1 + 1e-9) * self.shear_stiffness):
            raise BadArgument(f'membrane: shear_stiffness {self.shear_stiffness} N/m, rest_pressure {self.rest_pressure} Pa and curvature '
                              f'radius {self.rest_curvature_radius} m need 0 < pressure * radius / 2 <= stiffness; check membrane.*')

    @property
    def rest_tension(self) -> float:
        """Tension at rest, N/m."""
        return self.rest_pressure * self.rest_curvature_radius / 2


class Membrane:
    """The membrane between the dots of a rows x columns grid with rest positions rest_xyz (K, 3), m, in the order of their numbers;
    origin: (3,) m, camera centre.

    core: the running membrane (_core.Membrane), which holds the last frame. NaN rows of rest_xyz (dots missing from the reference) are
    interpolated. Raises BadArgument for too many dots, or less than half of the rest positions.
    Kernel: src/touchpad/membrane.cpp.
    """

    def __init__(self, rest_xyz: np.ndarray, rows: int, columns: int, origin: np.ndarray, material: MembraneMaterial | None = None,
                 model: _core.MembraneModel | None = None):
        if rows * columns > _MOST:
            raise BadArgument(f'membrane: {rows} x {columns} dots are more than the maximum of {_MOST}; check rows and columns')
        self.rows, self.columns = rows, columns
        self.material, self.origin, self._model = material or MembraneMaterial(), np.asarray(origin, float), model or _core.MembraneModel()
        self.core = self._at(rest_xyz)

    def _at(self, rest_xyz: np.ndarray) -> _core.Membrane:
        size, rest = self.rows * self.columns, np.asarray(rest_xyz, float)
        known = np.isfinite(rest).all(1)
        if known.sum() < size / 2:
            raise BadArgument(f'membrane: only {known.sum()} of {size} dots have a rest place; take a new reference')
        return _core.Membrane(
            fill_rest(rest, known, self.columns), rows=self.rows, columns=self.columns, stiffness=self.material.shear_stiffness,
            area_share=1 - self.material.rest_tension / self.material.shear_stiffness, pressure=self.material.rest_pressure,
            origin=self.origin, model=self._model)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Take other rest positions (K, 3), m, of a drifting reference. Raises BadArgument as the constructor."""
        self.core.take_rest(self._at(rest_xyz))

    def solve(self, rays: np.ndarray, ranges: np.ndarray, sigma: np.ndarray, ids: np.ndarray) -> _core.MembraneState:
        """The state of the next frame from measured ranges (N,) m along unit rays (N, 3) from the origin to the dots ids (N,).

        sigma: (N,) m, independent error of each range, without the errors that neighbours share; a NaN range is interpolated.
        """
        return self.core.solve(rays, ranges, sigma, ids)


def fill_rest(rest: np.ndarray, known: np.ndarray, columns: int) -> np.ndarray:
    """rest (K, 3) with unknown rows from a bicubic polynomial in row and column, fitted to the known ones."""
    if known.all():
        return rest
    row, column = np.divmod(np.arange(len(rest)), columns)
    y, x = 2 * row / row[-1] - 1, 2 * column / (columns - 1) - 1
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4)], axis=1)
    fit = np.linalg.lstsq(terms[known], rest[known], rcond=None)[0]
    return np.where(known[:, None], rest, terms @ fit)

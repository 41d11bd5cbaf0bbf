# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dot positions from measured ranges, regularised by the membrane's force balance.

Outside of contact the membrane's elastic force and the fluid's pressure cancel; in contact the residual is the object's pressure. Each dot
is free (residual: the mesh's discretisation error) or touched (residual: roughly the fluid's pressure): a mixture model with coupled
neighbours, solved by reweighted Gauss-Newton steps in the ranges, each one banded Cholesky solve. It assumes no object shape and no motion.

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
from .._core.touchpad import MAX_DOTS
from ..core.errors import BadArgument


@dataclass(frozen=True)
class MembraneMaterial:
    """Material and undeformed state of the membrane.

    Parameters
    ----------
    shear_stiffness : float
        Shear modulus times thickness in N/m.
    rest_pressure : float
        Gauge pressure of the fluid without contact in Pa.
    rest_curvature_radius : float
        Radius of curvature without contact in m.

    Raises
    ------
    BadArgument
        If the rest tension p R / 2 exceeds shear_stiffness, which a neo-Hookean membrane cannot carry.
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
    """The membrane between the dots of a grid. Kernel: src/touchpad/membrane.cpp.

    Parameters
    ----------
    rest_xyz : ndarray, shape (rows * columns, 3)
        Reference positions in m in the order of the dots' numbers; NaN rows, of dots missing from the reference, are interpolated.
    rows, columns : int
        Size of the grid.
    origin : ndarray, shape (3,)
        Camera centre in m.
    material : MembraneMaterial, optional
        Material.
    model : MembraneModel, optional
        Constants of the estimate.

    Attributes
    ----------
    core : _core.touchpad.Membrane
        The running membrane, which holds the last frame.

    Raises
    ------
    BadArgument
        If there are too many dots, or less than half of the reference positions are known.
    """

    def __init__(self, rest_xyz: np.ndarray, rows: int, columns: int, origin: np.ndarray, material: MembraneMaterial | None = None,
                 model: _core.touchpad.MembraneModel | None = None):
        if rows * columns > MAX_DOTS:
            raise BadArgument(f'membrane: {rows} x {columns} dots are more than the maximum of {MAX_DOTS}; check rows and columns')
        self.rows, self.columns = rows, columns
        self.material, self.origin = material or MembraneMaterial(), np.asarray(origin, float)
        self._model = model or _core.touchpad.MembraneModel()
        self.core = self._at(rest_xyz)

    def _at(self, rest_xyz: np.ndarray) -> _core.touchpad.Membrane:
        size, rest = self.rows * self.columns, np.asarray(rest_xyz, float)
        known = np.isfinite(rest).all(1)
        if known.sum() < size / 2:
            raise BadArgument(f'membrane: only {known.sum()} of {size} dots have a reference position; take a new reference')
        stiffness = self.material.shear_stiffness
        material = _core.touchpad.SkinMaterial(stiffness=stiffness, area_share=1 - self.material.rest_tension / stiffness,
                                               pressure=self.material.rest_pressure)
        return _core.touchpad.Membrane(fill_rest(rest, known, self.columns), rows=self.rows, columns=self.columns, material=material,
                                       origin=self.origin, model=self._model)

    def set_rest(self, rest_xyz: np.ndarray) -> None:
        """Take new rest positions (K, 3), m, of a drifting reference. Raises BadArgument as the constructor does."""
        self.core.take_rest(self._at(rest_xyz))

    def solve(self, rays: np.ndarray, ranges: np.ndarray, sigma: np.ndarray, ids: np.ndarray) -> _core.touchpad.MembraneState:
        """Estimate the state of the next frame from measured ranges.

        Parameters
        ----------
        rays : ndarray, shape (N, 3)
            Unit rays from the origin to the dots.
        ranges : ndarray, shape (N,)
            Measured distances along the rays in m; a dot with a NaN range is interpolated.
        sigma : ndarray, shape (N,)
            Independent error of each range in m, without the errors that neighbours share.
        ids : ndarray, shape (N,)
            Numbers of the dots.

        Returns
        -------
        MembraneState
            Positions, forces and loads of all dots.
        """
        return self.core.solve(rays, ranges, sigma, ids)


def fill_rest(rest: np.ndarray, known: np.ndarray, columns: int) -> np.ndarray:
    """Fill unknown rows of rest (K, 3) by a bicubic polynomial in row and column, fitted to the known ones."""
    if known.all():
        return rest
    row, column = np.divmod(np.arange(len(rest)), columns)
    y, x = 2 * row / row[-1] - 1, 2 * column / (columns - 1) - 1
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4)], axis=1)
    fit = np.linalg.lstsq(terms[known], rest[known], rcond=None)[0]
    return np.where(known[:, None], rest, terms @ fit)

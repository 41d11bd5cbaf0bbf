# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Finite elements of a sheet pressed by a round tip: incompressible neo-Hookean membrane, prestretched and clamped, with bending.

Lengths in m; energies per shear modulus times thickness, which scales the force but not the displacement.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from ...errors import BadArgument
from .mesh import SheetMesh


@dataclass(frozen=True)
class SheetMaterial:
    """prestretch: of the clamped sheet, above 1; bending: m^2, bending stiffness over shear modulus times thickness; friction: coefficient
    between tip and sheet. Raises BadArgument for numbers out of range.
    """

    prestretch: float = 1.03
    bending: float = 2e-7
    friction: float = 0.5

    def __post_init__(self):
        if not (1 < self.prestretch < 3 and 0 < self.bending < 1e-4 and 0 <= self.friction < 10):
            raise BadArgument(f'sheet material: need 1 < prestretch < 3, 0 < bending < 1e-4 m^2 and 0 <= friction < 10, got {self}')


def press_sheet(mesh: SheetMesh, depths: np.ndarray, radius: float, material: SheetMaterial,
                drag: tuple[float, float] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Displacement coefficients (D, side * side, 3), m, of the sheet under a tip of radius, m, at mesh.place at each of the rising depths
    (D,), m; and the wrench (D, 9) of the tip on the sheet: force, m, and moment about the tip, m^2, over shear modulus and thickness; and
    the centre of the pressure relative to the tip, m.

    drag: None for a tip that comes straight down, with Coulomb friction, which depends on the path; else the traction over the pressure
    (x, y) of a tip that slides. NaN from the first depth that does not converge.
    """
    return _core.press_sheet(mesh.value, mesh.slope, mesh.laplacian, mesh.weight, mesh.rest, np.asarray(depths, float),
                             place=tuple(mesh.place.tolist()), radius=radius, prestretch=material.prestretch, bending=material.bending,
                             friction=material.friction, slides=drag is not None, drag=(0.0, 0.0) if drag is None else tuple(drag))

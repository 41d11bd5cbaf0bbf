# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Finite elements of a clamped sheet pressed by a round tip.

The sheet is an incompressible neo-Hookean membrane, prestretched, with bending, on a mesh of quadratic B-splines that is refined around the
tip. Lengths are in m; energies are per shear modulus times thickness, which scales the force but not the displacement.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import _core
from ...core.errors import BadArgument
from ..simulated import GAUSS


def min_clamp_distance(scale: float) -> float:
    """Smallest distance, m, of the mesh's centre from the clamp; below it, the map of the mesh is not monotonic."""
    return 0.75 * scale


def may_be_pressed(positions: np.ndarray, half: np.ndarray, scale: float) -> np.ndarray:
    """Whether (N,) a mesh can be centred at positions (N, 2), m, of a sheet of half sides (2,), m; False for NaN."""
    return (half - np.abs(positions)).min(axis=1) >= min_clamp_distance(scale) * (1 - 1e-9)  # tolerance for rounding


def spread(xi: np.ndarray, pressed: float, half: float, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (N,), m, of xi (N,), and the first and second derivative by xi."""
    t, sign = np.abs(xi), np.where(xi >= 0, 1.0, -1.0)
    cubic = np.where(xi >= 0, half - pressed, half + pressed) - scale
    return pressed + sign * (scale * t + cubic * t**3), scale + 3 * cubic * t**2, sign * 6 * cubic * t


def basis(xi: np.ndarray, spans: int) -> tuple[np.ndarray, np.ndarray]:
    """First index (N,) int and values (N, 3, 3) at xi (N,) of the three quadratic B-splines there: value, first and second derivative.

    There are spans + 2 of them on spans equal spans over [-1, 1], open at both ends (the first alone is 1 at -1).
    """
    knots = np.concatenate([[-1.0] * 2, np.linspace(-1, 1, spans + 1), [1.0] * 2])
    first = np.clip(((xi + 1) * (spans / 2)).astype(int), 0, spans - 1)
    k = first + 2
    low, high = knots[k], knots[k + 1]
    width, below, above = high - low, high - knots[k - 1], knots[k + 2] - low
    a, b = (high - xi) / width, (xi - low) / width
    values = np.empty((len(xi), 3, 3))
    values[:, 0, 0], values[:, 0, 2] = a * (high - xi) / below, b * (xi - low) / above
    values[:, 1, 0], values[:, 1, 2] = -2 * a / below, 2 * b / above
    values[:, 2, 0], values[:, 2, 2] = 2 / (width * below), 2 / (width * above)
    values[:, :, 1] = np.array([1.0, 0.0, 0.0]) - values[:, :, 0] - values[:, :, 2]
    return first, values


def uniform(fields: np.ndarray, near_only: bool = False) -> np.ndarray:
    """Convert coefficients (..., side, side, m) on open B-splines, zero at the clamp, to uniform B-splines.

    near_only: of the first quarter of a mesh.
    """
    same = fields.copy()
    for axis in (-3, -2):
        same = np.moveaxis(same, axis, 0)
        same[0] = -same[1]
        if not near_only:
            same[-1] = -same[-2]
        same = np.moveaxis(same, 0, axis)
    return same


class SheetMesh:
    """Elements and integration points of a sheet of half (2,) m pressed at position (2,) m.

    Coefficients of a field are (side * side, 3) with side = 2 n + 2, those at the clamp zero. At the four points g of each element e:
    value (E, 4, 9), slope (E, 4, 2, 9) 1/m and laplacian (E, 4, 9) 1/m^2 of its nine functions, weight (E, 4) m^2, rest (E, 4, 2) m;
    nodes (E, 9) are their numbers.
    """

    def __init__(self, position: np.ndarray, half: np.ndarray, scale: float, n: int):
        self.position, self.half, self.scale, self.spans = np.asarray(position, float), np.asarray(half, float), scale, 2 * n
        self.side = self.spans + 2
        self._integrate()
        first = np.arange(self.spans)
        pairs = (first[:, None] + np.arange(3))
        self.nodes = (pairs[:, None, :, None] * self.side + pairs[None, :, None, :]).reshape(-1, 9)

    def _integrate(self) -> None:
        width = 1 / self.spans
        xi = ((2 * np.arange(self.spans) + 1) * width - 1)[:, None] + width * GAUSS
        axes = [self._axis(xi.ravel(), axis, width) for axis in (0, 1)]
        (x, value_x, slope_x, second_x, weight_x), (y, value_y, slope_y, second_y, weight_y) = axes
        self.value = self._tensor(value_x, value_y)
        self.slope = np.stack([self._tensor(slope_x, value_y), self._tensor(value_x, slope_y)], axis=2)
        self.laplacian = self._tensor(second_x, value_y) + self._tensor(value_x, second_y)
        self.weight = self._pair(weight_x, weight_y, np.multiply)
        self.rest = np.stack([self._pair(x, y, lambda a, b: a + 0 * b), self._pair(x, y, lambda a, b: b + 0 * a)], axis=-1)

    def _axis(self, xi: np.ndarray, axis: int, width: float) -> tuple:
        x, stretch, bend = spread(xi, self.position[axis], self.half[axis], self.scale)
        _, b = basis(xi, self.spans)
        second = (b[:, 2] - b[:, 1] * (bend / stretch)[:, None]) / stretch[:, None]**2
        return x, b[:, 0], b[:, 1] / stretch[:, None], second, stretch * width

    def _tensor(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        a, b = a.reshape(self.spans, 2, 3), b.reshape(self.spans, 2, 3)
        return np.einsum('agi,bhj->abghij', a, b).reshape(self.spans**2, 4, 9)

    def _pair(self, a: np.ndarray, b: np.ndarray, what) -> np.ndarray:
        return what(a.reshape(-1, 1, 2, 1), b.reshape(1, -1, 1, 2)).reshape(-1, 4)


@dataclass(frozen=True)
class SheetMaterial:
    """Material of a sheet.

    prestretch: of the clamped sheet, above 1; bending: m^2, bending stiffness over shear modulus times thickness; friction: coefficient
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
    """Simulate a tip of radius, m, at mesh.position at each of the rising depths (D,), m.

    Returns displacement coefficients (D, side * side, 3), m, of the sheet; and (D, 9), the wrench of the tip on the sheet (force, m, and
    moment about the tip, m^2, over shear modulus and thickness) and the centre of the pressure relative to the tip, m.

    drag: None for a tip that comes straight down, with Coulomb friction, which depends on the path; else the traction over the pressure
    (x, y) of a tip that slides. NaN from the first depth that does not converge.
    """
    load = _core.press.SheetLoad(position=np.asarray(mesh.position, float), radius=radius, slides=drag is not None,
                           drag=np.array((0.0, 0.0) if drag is None else drag, float), **vars(material))
    return _core.press.press_sheet(mesh, load, np.asarray(depths, float))

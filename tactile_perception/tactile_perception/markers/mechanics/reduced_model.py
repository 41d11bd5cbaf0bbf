# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reduced model of a pressed sheet: modes of precomputed presses, interpolated over place, depth and tip radius; and its form in a
calibration file."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import acos, sin

import numpy as np

from ...common.parallel import in_parallel
from ...errors import BadCalibration
from .membrane_fem import SheetMaterial, press_sheet
from .mesh import SheetMesh, least_length, uniform

SPREAD = np.log(1.35)  # simulated log tip radii, to either side of the calibrated one. Chosen
DEPTH_POWER = 1.5      # grading of the depths: denser at first contact. Chosen
TRUE = 1.5e-6          # m: modes below this RMS over the sheet are truncated. Chosen: below the noise of a marker
UNSOLVED = 0.1         # largest share of simulations that do not converge, as deep ones of a large tip near the clamp. Chosen
MIRROR = np.array([[-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])  # of a displacement, along x and along y


@dataclass(frozen=True)
class LibraryPlan:
    """half: (2,) m, half sides of the sheet; radius: m, the middle one; depth: m, largest; scale: m, of the mesh; n: spans from the tip to
    the clamp; order: nodes along a quarter of the sheet; levels: of depth; substeps: load steps between levels.
    """

    half: tuple[float, float]
    radius: float
    depth: float
    scale: float = 8e-3
    n: int = 9
    order: int = 4
    levels: int = 12
    substeps: int = 3

    @property
    def reach(self) -> np.ndarray:
        """(2,) m: largest distance of simulated presses from the centre."""
        return np.asarray(self.half) - 1.05 * least_length(self.scale)

    @property
    def depths(self) -> np.ndarray:
        """(levels,) m, rising to the largest."""
        return self.depth * (np.arange(1, self.levels + 1) / self.levels) ** DEPTH_POWER

    def load_steps(self, stops: np.ndarray) -> np.ndarray:
        """Load steps, m, through the rising stops (D,), m, fine enough for path-dependent friction."""
        fine = self.depth * (np.arange(1, self.levels * self.substeps + 1) / (self.levels * self.substeps)) ** DEPTH_POWER
        between = fine[fine < 0.999 * stops[-1]]
        between = between[np.abs(between[:, None] - stops).min(1, initial=np.inf) > 0.2 * self.depth / len(fine)]
        return np.union1d(between, stops)

    @property
    def radii(self) -> np.ndarray:
        """(3,) m."""
        return self.radius * np.exp(SPREAD * np.array([-1, 0, 1]))

    @property
    def nodes(self) -> np.ndarray:
        """(order,) Chebyshev nodes over reach, between 0 and 1."""
        return np.cos((2 * np.arange(self.order) + 1) * np.pi / (4 * self.order))


@dataclass
class ModeClass:
    """The modes of one parity: odd (2,) bool along x and y; coefficients (order, order, 3, levels + 3, m); modes (m, h, h, 3) on one
    quarter of the mesh.
    """

    odd: tuple[int, int]
    coefficients: np.ndarray
    modes: np.ndarray


class SheetLibrary:
    """Displacement fields of the sheet for any place, depth and radius of a round tip within plan, in single precision (1 nm)."""

    def __init__(self, plan: LibraryPlan, classes: list[ModeClass]):
        self.plan, self.classes = plan, classes
        self.side = 2 * plan.n + 2
        self._modes = np.concatenate([_whole(part).reshape(len(part.modes), -1) for part in classes]).astype(np.float32)
        self._table = self._tabulate()
        self._degree = np.arange(2 * plan.order)
        self._reach = tuple(plan.reach.tolist())

    def _tabulate(self) -> np.ndarray:
        """(levels + 3, 4 order^2 3, m): coefficients of all classes; those of a class are in the rows of its polynomials."""
        order, levels = self.plan.order, self.plan.levels + 3
        table = np.zeros((2 * order, 2 * order, 3, levels, len(self._modes)))
        first = 0
        for part in self.classes:
            count = len(part.modes)
            table[part.odd[0]::2, part.odd[1]::2, ..., first:first + count] = part.coefficients
            first += count
        return np.moveaxis(table, 3, 0).reshape(levels, -1, table.shape[-1]).astype(np.float32)

    def fields(self, place: np.ndarray, depth: float, log_radius: float) -> np.ndarray:
        """(side * side, 5, 3): coefficients, m, on uniform quadratic B-splines of a press at place (2,) m, depth m, with log_radius the log
        of the radius over the plan's; then their derivatives by place x, y, by depth and by log_radius.

        Arguments outside the plan are clamped to it.
        """
        (x, by_x), (y, by_y) = (self._polynomials(float(place[axis]), self._reach[axis]) for axis in (0, 1))
        e = min(max(log_radius / SPREAD, -1.2), 1.2)
        radial, by_radial = [1.0, e, e * e], [0.0, 1.0 / SPREAD, 2 * e / SPREAD]
        first, spline, by_depth = self._depth_weights(depth)
        along, across, size = np.array([x, by_x, x, x]), np.array([y, y, by_y, y]), np.array([radial, radial, radial, by_radial])
        over = ((along[:, :, None] * across[:, None])[..., None] * size[:, None, None]).reshape(4, -1)
        local = over.astype(np.float32) @ self._table[first:first + 4]
        mixed = np.empty((5, local.shape[-1]), np.float32)
        mixed[:4] = (spline @ local.reshape(4, -1)).reshape(4, -1)
        mixed[4], mixed[3] = mixed[3], by_depth @ local[:, 0]
        return (mixed @ self._modes).astype(float).reshape(5, -1, 3).transpose(1, 0, 2)

    def _polynomials(self, place: float, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Chebyshev polynomials (2 order,) at place and their derivatives, 1/m."""
        angle = acos(min(max(place / reach, -1 + 1e-6), 1 - 1e-6))
        angles = self._degree * angle
        return np.cos(angles), np.sin(angles) * (self._degree / (sin(angle) * reach))

    def _depth_weights(self, depth: float) -> tuple[int, np.ndarray, np.ndarray]:
        """First coefficient, weights (4,) and their derivatives, 1/m, of the cubic B-splines at depth."""
        share = min(max(depth / self.plan.depth, 1e-6), 1.0)
        level = share ** (1 / DEPTH_POWER) * self.plan.levels
        first = min(int(level), self.plan.levels - 1)
        f = level - first
        value = np.array([(1 - f)**3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3]) / 6
        slope = np.array([-(1 - f)**2, 3 * f**2 - 4 * f, -3 * f**2 + 2 * f + 1, f**2]) / 2
        return first, value, slope * (level / (DEPTH_POWER * share * self.plan.depth))


def _whole(part: ModeClass) -> np.ndarray:
    """The modes (m, side, side, 3) over the whole mesh, on uniform B-splines."""
    whole = part.modes
    for axis in (0, 1):
        mirrored = np.flip(whole, axis + 1) * MIRROR[axis] * (-1 if part.odd[axis] else 1)
        whole = np.concatenate([whole, mirrored], axis=axis + 1)
    return uniform(whole)


def build_library(plan: LibraryPlan, material: SheetMaterial) -> SheetLibrary:
    """Simulate the presses of plan on a sheet of that material. Raises BadCalibration where too many do not converge."""
    half_side = plan.n + 1
    places = plan.reach * np.stack(np.meshgrid(plan.nodes, plan.nodes, indexing='ij'), axis=-1).reshape(-1, 2)
    pressed = in_parallel(partial(_pressed, plan, material), list(places), 'places simulated for the library')
    solved = np.zeros((plan.order, plan.order, 3, plan.levels + 1, 2 * half_side, 2 * half_side, 3))
    solved[:, :, :, 1:] = np.reshape(pressed, (plan.order, plan.order, 3, plan.levels, *solved.shape[4:]))
    if np.isnan(solved[..., 0, 0, 0]).mean() > UNSOLVED:
        raise BadCalibration(f'simulated presses to {plan.depth * 1e3:.1f} mm with {material} do not converge; check size and depths')
    _extrapolate(solved, plan.depths)
    return SheetLibrary(plan, [_class(solved, odd, plan) for odd in ((0, 0), (0, 1), (1, 0), (1, 1))])


def _pressed(plan: LibraryPlan, material: SheetMaterial, place: np.ndarray) -> list[np.ndarray]:
    """Fields of the presses at one place, for each radius and depth."""
    mesh, way = SheetMesh(place, plan.half, plan.scale, plan.n), plan.load_steps(plan.depths)
    return [press_sheet(mesh, way, radius, material)[0][np.searchsorted(way, plan.depths)] for radius in plan.radii]


def _extrapolate(solved: np.ndarray, depths: np.ndarray) -> None:
    """Extrapolate linearly over depth where a simulation did not converge (NaN)."""
    depths = np.concatenate([[0.0], depths])
    for level in range(2, solved.shape[3]):
        missing = np.isnan(solved[:, :, :, level, 0, 0, 0])
        last, before = solved[:, :, :, level - 1][missing], solved[:, :, :, level - 2][missing]
        step = (depths[level] - depths[level - 1]) / (depths[level - 1] - depths[level - 2])
        solved[:, :, :, level][missing] = last + step * (last - before)


def _class(solved: np.ndarray, odd: tuple[int, int], plan: LibraryPlan) -> ModeClass:
    half_side = plan.n + 1
    part = solved
    for axis in (0, 1):
        part = (part + (-1 if odd[axis] else 1) * MIRROR[axis] * np.flip(part, 4 + axis)) / 2
    part = part[..., :half_side, :half_side, :].reshape(*solved.shape[:4], -1)
    snapshots = part.reshape(-1, part.shape[-1])
    _, strength, modes = np.linalg.svd(snapshots, full_matrices=False)
    count = max(1, int(np.sum(strength > TRUE * np.sqrt(snapshots.size))))
    mixed = part @ modes[:count].T
    angle = np.arccos(plan.nodes)[:, None] * np.arange(2 * plan.order)
    over = [np.linalg.inv(np.cos(angle[:, odd[axis]::2])) for axis in (0, 1)]
    radial = np.linalg.inv(np.array([[1.0, -1, 1], [1, 0, 0], [1, 1, 1]]))
    coefficients = np.einsum('ai,bj,ck,dl,ijklm->abcdm', over[0], over[1], radial, _spline_fit(plan.levels), mixed, optimize=True)
    return ModeClass(odd, coefficients, modes[:count].reshape(count, half_side, half_side, 3))


def _spline_fit(levels: int) -> np.ndarray:
    """(levels + 3, levels + 1): from values at levels 0 to levels to coefficients of uniform cubic B-splines, not-a-knot ends."""
    rows = np.zeros((levels + 3, levels + 3))
    for k in range(levels + 1):
        rows[k, k:k + 3] = np.array([1, 4, 1]) / 6
    rows[-2, :5] = rows[-1, -5:] = [1, -4, 6, -4, 1]
    return np.linalg.inv(rows)[:, :levels + 1]


_EACH = 60  # 16-bit values in one integer, which stays below the largest double
_LEVELS = 32000  # quantisation steps to either side of zero
_PLAN = ('radius', 'depth', 'scale', 'n', 'order', 'levels', 'substeps')


def pack(values: np.ndarray) -> dict:
    """Values of any shape, rounded to 1/32000 of the largest: {'scale': float, 'digits': list of int}."""
    scale = float(np.abs(values).max()) or 1.0
    digits = (np.round(values.ravel() / scale * _LEVELS) + _LEVELS).astype('<u2')
    digits = np.pad(digits, (0, -len(digits) % _EACH)).reshape(-1, _EACH)
    return {'scale': scale, 'digits': [int.from_bytes(row.tobytes(), 'little') for row in digits]}


def unpack(packed: Mapping, shape: tuple) -> np.ndarray:
    """Inverse of pack. Raises BadCalibration where numbers are missing or invalid."""
    try:
        raw = b''.join(number.to_bytes(2 * _EACH, 'little') for number in packed['digits'])
        values = np.frombuffer(raw, '<u2').astype(float)[:int(np.prod(shape))] - _LEVELS
        return values.reshape(shape) * (float(packed['scale']) / _LEVELS)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise BadCalibration(f'the library in the calibration file cannot be read ({error}); run calibrate again') from None


def library_numbers(library: SheetLibrary) -> dict:
    """The library as plain numbers."""
    classes = [{'odd': list(part.odd), 'modes': len(part.modes), 'shapes': pack(part.modes),
                'coefficients': [pack(part.coefficients[..., k]) for k in range(len(part.modes))]} for part in library.classes]
    return {'half': list(library.plan.half), **{name: getattr(library.plan, name) for name in _PLAN}, 'classes': classes}


def library_from_numbers(numbers: Mapping) -> SheetLibrary:
    """Inverse of library_numbers. Raises BadCalibration for an invalid mapping."""
    try:
        plan = LibraryPlan(tuple(numbers['half']), **{name: numbers[name] for name in _PLAN})
        classes = [_mode_class(part, plan) for part in numbers['classes']]
    except (KeyError, TypeError) as error:
        raise BadCalibration(f'the library in the calibration file cannot be read ({error}); run calibrate again') from None
    return SheetLibrary(plan, classes)


def _mode_class(part: Mapping, plan: LibraryPlan) -> ModeClass:
    order, levels, count = plan.order, plan.levels + 3, part['modes']
    coefficients = np.stack([unpack(packed, (order, order, 3, levels)) for packed in part['coefficients']], axis=-1)
    return ModeClass(tuple(part['odd']), coefficients, unpack(part['shapes'], (count, plan.n + 1, plan.n + 1, 3)))

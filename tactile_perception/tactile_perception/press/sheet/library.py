# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reduced model of a pressed sheet: modes of simulated presses, interpolated over position, depth and tip radius."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ... import _core
from ...common.geometry import extrapolate, spline_fit
from ...common.progress import in_parallel
from ...core.errors import BadCalibration
from ..constants import PRESS, SHEET
from .mechanics import SheetMaterial, SheetMesh, min_clamp_distance, press_sheet, uniform

TERMS = 12  # of the table: a parabola in the log radius, then x, y, x^2, x y, y^2, x^3, x^2 y, x y^2, y^3 of the drag
TERM_WEIGHTS = 0.5 ** np.array([0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 3, 3])  # sizes of the terms for a common drag
ODD_TERMS = (0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 1, 0), (0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1)  # terms whose sign a mirror along x, along y inverts
CLASSES = [(0, 0), (0, 1), (1, 0), (1, 1)]  # odd along x, along y
WRENCH_NUMBERS = [[0, 8], [2, 3, 7], [1, 4, 6], [5]]  # of _normalised, by class
MIRROR = np.array([[-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])  # of a displacement, along x and along y


@dataclass(frozen=True)
class LibraryPlan:
    """Plan of the simulated presses.

    half: (2,) m, half sides of the sheet; radius: m, of the middle tip; depth: m, largest; scale: m, of the mesh; n: spans from the tip to
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
        """Largest distance (2,), m, of simulated presses from the centre."""
        return np.asarray(self.half) - 1.05 * min_clamp_distance(self.scale)

    @property
    def depths(self) -> np.ndarray:
        """Depths (levels,), m, rising to the largest."""
        return self.depth * (np.arange(1, self.levels + 1) / self.levels) ** PRESS.depth_power

    def load_steps(self, stops: np.ndarray) -> np.ndarray:
        """Load steps, m, through the rising stops (D,), m, fine enough for path-dependent friction."""
        fine = self.depth * (np.arange(1, self.levels * self.substeps + 1) / (self.levels * self.substeps)) ** PRESS.depth_power
        between = fine[fine < 0.999 * stops[-1]]
        between = between[np.abs(between[:, None] - stops).min(1, initial=np.inf) > 0.2 * self.depth / len(fine)]
        return np.union1d(between, stops)

    @property
    def radii(self) -> np.ndarray:
        """Radii (3,) of the simulated tips in m."""
        return self.radius * np.exp(SHEET.radius_spread * np.array([-1, 0, 1]))

    @property
    def nodes(self) -> np.ndarray:
        """Chebyshev nodes (order,) between 0 and 1, of the nearness to the clamp over the largest."""
        return np.cos((2 * np.arange(self.order) + 1) * np.pi / (4 * self.order))

    @property
    def positions(self) -> np.ndarray:
        """Positions (2, order), m, of the nodes along x and along y.

        Nearness is the inverse hyperbolic tangent of position over half side; near the clamp, the stiffness of a press is proportional to
        it.
        """
        half = np.asarray(self.half)[:, None]
        return half * np.tanh(np.arctanh(self.reach[:, None] / half) * self.nodes)


@dataclass
class ModeClass:
    """Modes of one parity: modes (m, h, h, 3) on one quarter of the mesh; coefficients (order, order, TERMS, levels + 3, m + w) of
    these and of the w numbers of the wrench with that parity.
    """

    coefficients: np.ndarray
    modes: np.ndarray


@dataclass
class SheetLibrary:
    """Displacement fields and wrenches for any position, depth, radius and drag of a round tip within plan, on a sheet of the material, in
    single precision (1 nm); classes: as CLASSES.

    table: the lookup table. Raises ValueError for classes that do not fit the plan.
    """

    plan: LibraryPlan
    material: SheetMaterial
    classes: list[ModeClass]

    def __post_init__(self):
        plan, classes = self.plan, self.classes
        widening = 3 * self.material.prestretch**-6  # of the sheet's stiffness against a change of area over that against shear
        covered = _core.press.SheetPlan(half=np.array(plan.half, float), reach=plan.reach, scale=plan.scale, depth=plan.depth,
                                        spread=SHEET.radius_spread, power=PRESS.depth_power, widening=widening / (2 + 2 * widening),
                                        n=plan.n, order=plan.order, levels=plan.levels)
        coefficients = [part.coefficients.transpose(3, 2, 0, 1, 4).ravel() for part in classes]
        shapes = [uniform(part.modes, near_only=True).ravel() for part in classes]
        self.table = _core.press.SheetTable(covered, modes=np.array([len(part.modes) for part in classes]),
                                      coefficients=np.concatenate(coefficients).astype(np.float32),
                                      shapes=np.concatenate(shapes).astype(np.float32))


def build_library(plan: LibraryPlan, material: SheetMaterial) -> SheetLibrary:
    """Simulate the presses of plan, straight and dragged, on a sheet of that material.

    Raises BadCalibration if too many do not converge.
    """
    positions = np.stack(np.meshgrid(*plan.positions, indexing='ij'), axis=-1).reshape(-1, 2)
    pressed = in_parallel(partial(_pressed, plan, material), list(positions), 'positions simulated for the library')
    shape = plan.order, plan.order, TERMS, plan.levels
    fields, wrenches = (np.reshape(part, (*shape, *part[0].shape[2:])) for part in zip(*pressed))
    solved = np.concatenate([np.zeros_like(fields[:, :, :, :1]), fields], axis=3)
    wrench = np.concatenate([np.full_like(wrenches[:, :, :, :1], np.nan), wrenches], axis=3)
    if np.isnan(fields[:, :, :3, :, 0, 0, 0]).mean() > SHEET.max_unsolved_share:
        raise BadCalibration(f'simulated presses to {plan.depth * 1e3:.1f} mm with {material} do not converge; check size and depths')
    depths = np.concatenate([[0.0], plan.depths])
    for part in (solved, wrench):
        extrapolate(part.reshape(-1, *part.shape[3:]), depths)
    wrench[:, :, :, 0] = 2 * wrench[:, :, :, 1] - wrench[:, :, :, 2]
    return SheetLibrary(plan, material, [_class(solved, wrench, odd, plan) for odd in CLASSES])


def _pressed(plan: LibraryPlan, material: SheetMaterial, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Fields (TERMS, levels, side, side, 3), m, and wrenches (TERMS, levels, 9), as of _normalised, of the presses at one position.

    The first terms belong to the radii, the others are coefficients of the change with the drag.
    """
    mesh, steps = SheetMesh(position, plan.half, plan.scale, plan.n), plan.load_steps(plan.depths)
    stops = np.searchsorted(steps, plan.depths)
    straight = [press_sheet(mesh, steps, radius, material) for radius in plan.radii]
    fields = np.zeros((TERMS, plan.levels, mesh.side, mesh.side, 3))
    wrenches = np.zeros((TERMS, plan.levels, 9))
    for k, (field, wrench) in enumerate(straight):
        fields[k], wrenches[k] = field[stops].reshape(fields.shape[1:]), _normalised(wrench[stops], plan.depths)
    slid = [part for n in range(len(SHEET.tractions)) for part in _slid(plan, material, mesh, n)]
    more = np.array([field.reshape(fields.shape[1:]) - fields[1] for field, _ in slid])
    reported = np.array([_normalised(wrench, plan.depths) - wrenches[1] for _, wrench in slid])
    for level in range(plan.levels):
        _by_drag(fields, more, reported, level, plan.depths)
        _by_drag(wrenches, reported, reported, level, plan.depths)
        wrenches[3:, level, 1:3] = np.eye(TERMS - 3, 2)  # the drag itself
    return fields, wrenches


def _slid(plan: LibraryPlan, material: SheetMaterial, mesh: SheetMesh, n: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Fields (levels, side * side, 3), m, and wrenches (levels, 9) of the drags of traction n.

    The directions of every second traction are rotated by half a step. NaN from the first depth at which any of them does not converge.
    """
    stops, slid = plan.depths, []
    for angle in (np.arange(SHEET.directions) + 0.5 * (n % 2)) * 2 * np.pi / SHEET.directions:
        drag = SHEET.tractions[n] * np.cos(angle), SHEET.tractions[n] * np.sin(angle)
        slid.append(press_sheet(mesh, stops, plan.radius, material, drag))
        stops = stops[:np.isfinite(slid[-1][1][:, 0]).sum()]
    beyond = plan.levels - len(stops)
    return [tuple(np.pad(part[:len(stops)], [(0, beyond)] + [(0, 0)] * (part.ndim - 1), constant_values=np.nan) for part in one)
            for one in slid]


def _by_drag(terms: np.ndarray, more: np.ndarray, reported: np.ndarray, level: int, depths: np.ndarray) -> None:
    """Set the coefficients of the drag terms (TERMS, level, ...) from the changes by simulated drags.

    more: (K, levels, ...), changes; reported: (K, levels, 9), the drags, as of _normalised. The coefficients are those nearest to the
    extrapolation of the previous levels, because in deep presses only the smaller tractions converge, and some nowhere.
    """
    solved = np.isfinite(reported[:, level]).all(axis=1)
    before = [np.zeros_like(terms[3:, 0]), *np.moveaxis(terms[3:, max(level - 2, 0):level], 1, 0)][-2:]
    likely = before[-1]
    if level:
        last, one = depths[level - 1], depths[level - 2] if level > 1 else 0.0
        likely = likely + (before[-1] - before[-2]) * (depths[level] - last) / (last - one)
    x, y = reported[solved, level, 1], reported[solved, level, 2]
    drag_terms = np.stack([x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3], axis=1)
    terms[3:, level] = likely + np.tensordot(np.linalg.pinv(drag_terms), more[solved, level] - np.tensordot(drag_terms, likely, 1), 1)


def _normalised(wrench: np.ndarray, depths: np.ndarray) -> np.ndarray:
    """Normalise wrenches (D, 9).

    Returns (D, 9): log of normal force over depth; tangential over normal force; moment over normal force, m; centre of the pressure
    relative to the tip, m.
    """
    push = -wrench[:, 2:3]
    return np.concatenate([np.log(np.maximum(push, 1e-15) / depths[:, None]), wrench[:, :2] / push, wrench[:, 3:6] / push, wrench[:, 6:]],
                          axis=1)


def _class(solved: np.ndarray, wrench: np.ndarray, odd: tuple[int, int], plan: LibraryPlan) -> ModeClass:
    quarter = plan.n + 1
    part = solved
    for axis in (0, 1):
        part = (part + (-1 if odd[axis] else 1) * MIRROR[axis] * np.flip(part, 4 + axis)) / 2
    part = part[..., :quarter, :quarter, :].reshape(*solved.shape[:4], -1)
    snapshots = (part * TERM_WEIGHTS[:, None, None]).reshape(-1, part.shape[-1])
    _, strength, modes = np.linalg.svd(snapshots, full_matrices=False)
    count = max(1, int(np.sum(strength > SHEET.min_mode_rms * np.sqrt(snapshots.size))))
    mixed = np.concatenate([part @ modes[:count].T, wrench[..., WRENCH_NUMBERS[CLASSES.index(odd)]]], axis=-1)
    angle = np.arccos(plan.nodes)[:, None] * np.arange(2 * plan.order)
    even_odd = [np.linalg.inv(np.cos(angle[:, parity::2])) for parity in (0, 1)]
    mixed[:, :, :3] = np.einsum('ck,ijklm->ijclm', np.linalg.inv(np.array([[1.0, -1, 1], [1, 0, 0], [1, 1, 1]])), mixed[:, :, :3])
    coefficients = np.stack([np.einsum('ai,bj,dl,ijlm->abdm', even_odd[odd[0] ^ ODD_TERMS[0][k]], even_odd[odd[1] ^ ODD_TERMS[1][k]],
                                       spline_fit(plan.levels), mixed[:, :, k], optimize=True) for k in range(TERMS)], axis=2)
    return ModeClass(coefficients.astype(np.float32), modes[:count].reshape(count, quarter, quarter, 3).astype(np.float32))


@dataclass(frozen=True)
class Press:
    """A round tip on the sheet.

    position: (2,) m, of the tip; depth: m, as if it were alone; log_radius: log of its radius over the calibrated one; drag: (2,)
    tangential over normal force, in addition to that of a tip that came straight down.
    """

    position: np.ndarray
    depth: float
    log_radius: float = 0.0
    drag: tuple[float, float] = (0.0, 0.0)

    @property
    def vector(self) -> np.ndarray:
        """Array (6,) of position, depth, log radius and drag."""
        return np.array([*self.position, self.depth, self.log_radius, *self.drag])

    @classmethod
    def of(cls, vector: np.ndarray) -> Press:
        """Inverse of vector."""
        return cls(vector[:2], float(vector[2]), float(vector[3]), (float(vector[4]), float(vector[5])))


def vectors(presses: Sequence[Press]) -> np.ndarray:
    """Arrays (T, 6) of presses."""
    return np.array([press.vector for press in presses])


def field_appearance(field: np.ndarray, plan: LibraryPlan, position: np.ndarray, rest: np.ndarray, camera_centre: np.ndarray,
                     marker_radius: float) -> np.ndarray:
    """Shift, m, and growth (K, 3) in the plane z = 0 of discs of marker_radius, m, at rest (K, 2), m, seen from camera_centre (K, 3), m.

    field: coefficients (side * side, 3), m, on uniform B-splines, of the sheet pressed at position (2,) m. Growth is the log of the ratio
    of the areas as imaged.
    """
    markers = _core.press.SheetMarkers(rest=rest, camera_centre=camera_centre, radius=marker_radius)
    return _core.press.show_field(field.astype(np.float32), markers, position=tuple(position), half=plan.half, scale=plan.scale)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Library of simulated presses on a dome, reduced to few modes and interpolated over place, depth, tip radius and friction; and its form
in a calibration file."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from ... import _core
from ...common.geometry import Cap, extrapolate, spline_fit
from ...common.progress import in_parallel
from ...errors import BadCalibration
from .mechanics import STRETCH, DomeMaterial, DomeMesh, MeshPlan, OnMesh, PressedDome, appear_at, disc_scale, outlines, press_dome, shift_of

RADIUS_SPREAD = np.log(2.2)    # simulated log tip radii, to either side of the middle one. Chosen
RADII = 4                      # simulated tips. Chosen
#: Simulated numbers of friction: over that of the plan, less 1; none, as of a tip in gross slip, and the plan's, beyond which skin sticks
FRICTIONS = np.array([-1.0, 0.0])
DEPTH_POWER = 1.5              # grading of the depths: denser at first contact. Chosen
TRUE = 1.5e-6                  # m: modes below this RMS are left out. Chosen: below the noise of a marker
UNSOLVED = 0.2                 # largest share of presses that do not converge, as deep ones of a large tip near the rim. Chosen
UNIFORM = MeshPlan(even=1, rings=1, width=1.0, harmonics=0)  # of what is the same all over the dome
_EDGE = 0.5 / STRETCH**2        # weight of the outline in the mean of a disc, for which that is exact to cubic terms
DRAGGED = 0.5                  # way of a drag over its depth, for which what markers show of it is exact. Chosen


@dataclass(frozen=True)
class DomePlan:
    """rim_radius, height: m, of the dome; radius: m, the middle tip's; depth: m, deepest; reach: m, largest
    distance of a tip from the axis; marker: m, radius of a marker; camera_centre: m, height of the camera, taken on the axis; order: places
    simulated along a meridian; levels: of depth; substeps: load steps between two levels.
    """

    rim_radius: float
    height: float
    radius: float
    depth: float
    reach: float
    marker: float
    camera_centre: float
    order: int = 5
    levels: int = 10
    substeps: int = 2

    @property
    def cap(self) -> Cap:
        """The untouched dome."""
        return Cap((self.rim_radius**2 + self.height**2) / (2 * self.height), self.height)

    @property
    def largest_shift(self) -> float:
        """The mesh's shift at the reach, of the smallest tip, whose touch is the farthest out."""
        return shift_of(self.reach, self.radius * np.exp(-RADIUS_SPREAD), self.cap)

    @property
    def load_steps(self) -> np.ndarray:
        """(levels substeps,) m; the last of each level is a depth of the library."""
        return self.depth * (np.arange(1, self.levels * self.substeps + 1) / (self.levels * self.substeps)) ** DEPTH_POWER

    @property
    def shifts(self) -> np.ndarray:
        """(2 order,) Chebyshev nodes from the largest shift to its mirror image."""
        return self.largest_shift * np.cos((2 * np.arange(2 * self.order) + 1) * np.pi / (4 * self.order))


@dataclass(frozen=True)
class DomeTable:
    """Coefficients of fields of a mesh by their modes. even_table (levels + 3, 4, 2 order, RADII, even): of straight presses by powers of
    the number of friction; of drags along the meridian by a tip that sticks, over the way over the depth that it carries the skin; and of
    what a tip that rubs shows more; over even_modes (even, rings + 1, 3, harmonics + 1). odd_table (levels + 3, 2, 2 order, RADII, odd) and
    odd_modes: of drags across it. In single precision."""

    mesh: MeshPlan
    even_table: np.ndarray
    even_modes: np.ndarray
    odd_table: np.ndarray
    odd_modes: np.ndarray


@dataclass
class DomeLibrary:
    """Displacement of a dome's markers under presses within plan, on a skin of the material. shown: what markers show of it, see AsSeen;
    pushed: the forces of the tips over the shear modulus and thickness, as displacements that are the same all over the dome. Raises
    ValueError for tables that do not fit the plan."""

    plan: DomePlan
    material: DomeMaterial
    shown: DomeTable
    pushed: DomeTable

    def __post_init__(self):
        plan, cap = self.plan, self.plan.cap
        numbers = np.array([cap.curvature_radius, cap.centre_z, disc_scale(cap), plan.largest_shift, plan.depth, DEPTH_POWER, plan.radius,
                            RADIUS_SPREAD])
        arrays = [{name: np.asarray(part, np.float32) for name, part in vars(table).items() if name != 'mesh'}
                  for table in (self.shown, self.pushed)]
        self.kernel, self._pushes = (_core.DomeLibrary(numbers=numbers, edges=table.mesh.edges, **one)
                                     for table, one in zip((self.shown, self.pushed), arrays))

    def moved(self, points: np.ndarray, presses: np.ndarray) -> np.ndarray:
        """(K, 3) displacement, m, of markers at points (K, 3), m, under presses (n, 7): see _core.DomeLibrary.moved."""
        return self.kernel.moved(points=points, presses=np.asarray(presses, float))

    def push(self, press: np.ndarray) -> np.ndarray:
        """(3,) m, force of the tip on the dome over the shear modulus and thickness, of a press (7,)."""
        return self._pushes.moved(points=np.array([[0.0, 0.0, self.plan.height]]), presses=press[None])[0]


def build_library(plan: DomePlan, material: DomeMaterial, mesh: MeshPlan = MeshPlan()) -> DomeLibrary:
    """Simulate the presses of plan on a dome of that material. Raises BadCalibration where too many do not converge."""
    cases = [(shift, radius, friction) for shift, radius, friction in
             product(plan.shifts[:plan.order], np.linspace(-1, 1, RADII), FRICTIONS)]
    pressed = in_parallel(partial(_pressed, plan, material, mesh), cases, 'presses simulated for the library')
    shape = plan.order, RADII, len(FRICTIONS), plan.levels
    fields = [np.reshape([getattr(one, name) for one in pressed], (*shape, mesh.rings + 1, 3, mesh.harmonics + 1))
              for name in ('straight', 'along', 'across')]
    if np.isnan(fields[0][..., 0, 0, 0]).mean() > UNSOLVED:
        raise BadCalibration(f'simulated presses to {plan.depth * 1e3:.1f} mm with {material} do not converge; check dome and depths')
    pushes = [np.repeat(np.reshape([getattr(one, name) for one in pressed], (*shape, 1, 3, 1)), 2, axis=4)
              for name in ('push', 'push_along', 'push_across')]
    return DomeLibrary(plan, material, _assembled(plan, mesh, fields), _assembled(plan, UNIFORM, pushes))


def _assembled(plan: DomePlan, mesh: MeshPlan, fields: list[np.ndarray]) -> DomeTable:
    """The table of straight presses, drags along and drags across, (order, RADII, frictions, levels, rings + 1, 3, harmonics + 1) each."""
    straight, *drags = fields
    rubs, sticks = range(len(FRICTIONS))
    kinds = [_filled(part, plan) for part in np.moveaxis(straight, 2, 0)]
    even = [_mirrored(part, odd=False, turned=False) for part in kinds]
    both = []
    for part, odd in zip(drags, (False, True)):
        stuck, rubbed = (_filled(part[:, :, k], plan) for k in (sticks, rubs))
        both.append([_mirrored(kind, odd=odd, turned=not odd) for kind in (stuck, rubbed - stuck)])
    return DomeTable(mesh, *_reduced(even + both[0], plan), *_reduced(both[1], plan))


def _pressed(plan: DomePlan, material: DomeMaterial, mesh_plan: MeshPlan, case: tuple[float, float, float]) -> PressedDome:
    """Fields at the levels of one press, as markers show them; case: shift of the mesh, log radius over the spread and number of
    friction."""
    shift, radius, friction = case
    mesh = DomeMesh(shift, plan.cap, mesh_plan)
    rough = replace(material, friction=material.friction * (1 + friction))
    found = press_dome(mesh, plan.load_steps, plan.radius * np.exp(RADIUS_SPREAD * radius), rough, drags=plan.substeps)
    level = slice(plan.substeps - 1, None, plan.substeps)
    shown = AsSeen(mesh, plan.marker, plan.camera_centre).fields(found.straight[level], found.along[level], found.across[level])
    return PressedDome(*shown, found.push[level], found.push_along[level], found.push_across[level])


class AsSeen:
    """From fields of a mesh to those that a marker of radius marker, m, shows: along the axis its mean, and aside what moves its centroid
    as a camera on the axis at the height camera centre, m, sees it."""

    def __init__(self, mesh: DomeMesh, marker: float, camera_centre: float):
        self._mesh, order = mesh, np.arange(mesh.plan.harmonics + 1)
        count = 2 * mesh.plan.harmonics + 2
        phi = (np.arange(count) + 0.5) * np.pi / count
        points = mesh.points(mesh.plan.edges[:, None] * np.exp(1j * phi)).reshape(-1, 3)
        self._points, self._camera_centre = points, np.array([0.0, 0.0, camera_centre])
        self._outlines = outlines(points, marker, mesh.cap)
        self._on_mesh = OnMesh(mesh, self._outlines.reshape(-1, 3))
        norm = np.where(order == 0, 1.0, 2.0) / count
        self._onto = [wave(np.outer(phi, order)) * norm for wave in (np.cos, np.sin)]  # (count, harmonics + 1)
        offset = points - self._camera_centre
        self._still = offset[:, :2] / offset[:, 2:] - appear_at(self._outlines, self._camera_centre)

    def fields(self, straight: np.ndarray, along: np.ndarray, across: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of PressedDome, (D, size) each; drags change them linearly, as at DRAGGED of their way."""
        shown = np.full((3, *straight.shape), np.nan)
        for k in np.flatnonzero(np.isfinite(straight[:, 0])):
            base = self._displaced(straight[k], False)
            shown[0, k] = self._field(self._shown(base), False)
            for kind, way in ((1, along[k]), (2, across[k])):
                aside = DRAGGED * self._displaced(way, kind == 2)
                shown[kind, k] = self._field(self._shown(base + aside) - self._shown(base - aside), kind == 2) / (2 * DRAGGED)
        return tuple(shown)

    def _displaced(self, field: np.ndarray, odd: bool) -> np.ndarray:
        """(N, COUNT + 1, 3) m, displacement of the outlines under a field (size,)."""
        return self._on_mesh.displaced(field, odd).reshape(self._outlines.shape)

    def _shown(self, moved: np.ndarray) -> np.ndarray:
        """(N, 3) m, displacement that markers show whose outlines moved by (N, COUNT + 1, 3), m."""
        up = (1 - _EDGE) * moved[:, 0, 2] + _EDGE * moved[:, 1:, 2].mean(axis=1)
        seen = self._still + appear_at(self._outlines + moved, self._camera_centre)
        aside = seen * (self._points[:, 2] + up - self._camera_centre[2])[:, None] - self._points[:, :2]
        return np.column_stack([aside, up])

    def _field(self, shown: np.ndarray, odd: bool) -> np.ndarray:
        """(size,) of displacements (N, 3) at the mesh's rings and directions."""
        at = shown.reshape(self._mesh.n + 1, -1, 3)
        field = np.stack([at[..., axis] @ self._onto[(axis == 1) != odd] for axis in range(3)], axis=1)
        return np.where(self._mesh.free[odd], field.ravel(), 0.0)


def _filled(fields: np.ndarray, plan: DomePlan) -> np.ndarray:
    """Fields (order, RADII, levels + 1, ...) with the untouched one; extrapolated over depth where there is none (NaN)."""
    whole = np.concatenate([np.zeros_like(fields[:, :, :1]), fields], axis=2)
    extrapolate(whole.reshape(-1, *whole.shape[2:]), np.concatenate([[0.0], plan.load_steps[plan.substeps - 1::plan.substeps]]))
    return np.nan_to_num(whole)


def _mirrored(fields: np.ndarray, odd: bool, turned: bool) -> np.ndarray:
    """(2 order, ...): the fields with those of presses mirrored along x; odd: of odd fields; turned: whether what they show turns its
    direction in the mirror."""
    order = np.arange(fields.shape[-1])
    # cos m (pi - phi) = (-1)^m cos m phi, sin m (pi - phi) = -(-1)^m sin m phi; the mirror turns x round.
    sign = (-1.0)**order * (np.array([[-1.0], [-1.0], [1.0]]) if not odd else np.array([[1.0], [1.0], [-1.0]]))
    return np.concatenate([fields, fields[::-1] * (-sign if turned else sign)])


def _reduced(kinds: list[np.ndarray], plan: DomePlan) -> tuple[np.ndarray, np.ndarray]:
    """Table and modes of kinds of fields (2 order, RADII, levels + 1, rings + 1, 3, harmonics + 1)."""
    shape = kinds[0].shape
    snapshots = np.reshape(kinds, (-1, int(np.prod(shape[3:]))))
    _, strength, modes = np.linalg.svd(snapshots, full_matrices=False)
    modes = modes[:max(1, int(np.sum(strength > TRUE * np.sqrt(snapshots.size))))]
    mixed = np.reshape(snapshots @ modes.T, (len(kinds), *shape[:3], len(modes)))
    if len(kinds) > len(FRICTIONS):  # straight presses by powers of the number of friction
        powers = np.linalg.inv(np.vander(FRICTIONS, increasing=True))
        mixed[:len(FRICTIONS)] = np.einsum('pf,fabcm->pabcm', powers, mixed[:len(FRICTIONS)])
    angle = (2 * np.arange(2 * plan.order) + 1) * np.pi / (4 * plan.order)
    over_shift = np.linalg.inv(np.cos(np.outer(angle, np.arange(2 * plan.order))))
    over_radius = np.linalg.inv(np.vander(np.linspace(-1, 1, RADII), increasing=True))
    table = np.einsum('ai,cj,dl,kijlm->dkacm', over_shift, over_radius, spline_fit(plan.levels), mixed, optimize=True)
    return tuple(np.ascontiguousarray(part, np.float32) for part in (table, modes.reshape(len(modes), *shape[3:])))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Library of simulated presses on a dome, reduced to few modes and interpolated over position, depth, tip radius and friction; and its form
in a calibration file."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from ... import _core
from ...common.geometry import Cap, extrapolate, spline_fit
from ...common.progress import in_parallel
from ...core.errors import BadCalibration
from ..constants import DOME, PRESS
from .mechanics import DomeMaterial, DomeMesh, MeshPlan, OnMesh, PressedDome, appear_at, disc_scale, outlines, press_dome, shift_of

#: Simulated friction numbers, friction over that of the plan minus 1: none, as of a tip in gross slip, and that of the plan, above which
#: skin sticks
FRICTIONS = np.array([-1.0, 0.0])
UNIFORM = MeshPlan(even=1, rings=1, width=1.0, harmonics=0)  # of quantities that are constant over the dome


@dataclass(frozen=True)
class DomePlan:
    """Plan of the simulated presses.

    rim_radius, height: m, of the dome; radius: m, of the middle tip; depth: m, largest; reach: m, largest distance of a tip from the axis;
    marker: m, radius of a marker; camera_centre: m, height of the camera, assumed on the axis; order: positions simulated along a meridian;
    levels: of depth; substeps: load steps between two levels.
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
        """Shift of the mesh at the reach, of the smallest tip, whose contact is the farthest from the axis."""
        return shift_of(self.reach, self.radius * np.exp(-DOME.radius_spread), self.cap)

    @property
    def load_steps(self) -> np.ndarray:
        """Load steps (levels * substeps,), m; the last of each level is a depth of the library."""
        return self.depth * (np.arange(1, self.levels * self.substeps + 1) / (self.levels * self.substeps)) ** PRESS.depth_power

    @property
    def shifts(self) -> np.ndarray:
        """Chebyshev nodes (2 order,) from the largest shift to its mirror image."""
        return self.largest_shift * np.cos((2 * np.arange(2 * self.order) + 1) * np.pi / (4 * self.order))


@dataclass(frozen=True)
class DomeTable:
    """Coefficients of fields of a mesh by their modes, in single precision.

    even_table (levels + 3, 4, 2 order, tips, even), over even_modes (even, rings + 1, 3, harmonics + 1): of straight presses, by powers of
    the friction number; of drags along the meridian by a sticking tip, per displacement over depth; and of the difference of a rubbing tip.
    odd_table (levels + 3, 2, 2 order, tips, odd) and odd_modes: of drags across the meridian.
    """

    mesh: MeshPlan
    even_table: np.ndarray
    even_modes: np.ndarray
    odd_table: np.ndarray
    odd_modes: np.ndarray


@dataclass
class DomeLibrary:
    """Displacement of a dome's markers under presses within plan, on a skin of the material.

    shown: apparent displacement of the markers, see AsSeen; pushed: forces of the tips over shear modulus and thickness, as displacements
    that are constant over the dome. Raises ValueError for tables that do not fit the plan.
    """

    plan: DomePlan
    material: DomeMaterial
    shown: DomeTable
    pushed: DomeTable

    def __post_init__(self):
        plan, cap = self.plan, self.plan.cap
        covered = _core.press.DomePlan(curvature=cap.curvature_radius, centre_z=cap.centre_z, disc_scale=disc_scale(cap),
                                 reach=plan.largest_shift, depth=plan.depth, power=PRESS.depth_power, radius=plan.radius,
                                 radius_spread=DOME.radius_spread)
        arrays = [{name: np.asarray(part, np.float32) for name, part in vars(table).items() if name != 'mesh'}
                  for table in (self.shown, self.pushed)]
        self.kernel, self.pushes = (_core.press.DomeLibrary(covered, edges=table.mesh.edges, **one)
                                     for table, one in zip((self.shown, self.pushed), arrays))

    def moved(self, points: np.ndarray, presses: np.ndarray) -> np.ndarray:
        """Displacements (K, 3), m, of markers at points (K, 3), m, under presses (n, 7): see _core.press.DomeLibrary.moved."""
        return self.kernel.moved(points=points, presses=np.asarray(presses, float))

    def push(self, press: np.ndarray) -> np.ndarray:
        """Force (3,), m, of the tip on the dome over shear modulus and thickness, of a press (7,)."""
        return self.pushes.moved(points=np.array([[0.0, 0.0, self.plan.height]]), presses=press[None])[0]


def build_library(plan: DomePlan, material: DomeMaterial, mesh: MeshPlan = MeshPlan()) -> DomeLibrary:
    """Simulate the presses of plan on a dome of this material. Raises BadCalibration if too many do not converge."""
    cases = [(shift, radius, friction) for shift, radius, friction in
             product(plan.shifts[:plan.order], np.linspace(-1, 1, DOME.tips), FRICTIONS)]
    pressed = in_parallel(partial(_pressed, plan, material, mesh), cases, 'presses simulated for the library')
    shape = plan.order, DOME.tips, len(FRICTIONS), plan.levels
    fields = [np.reshape([getattr(one, name) for one in pressed], (*shape, mesh.rings + 1, 3, mesh.harmonics + 1))
              for name in ('straight', 'along', 'across')]
    if np.isnan(fields[0][..., 0, 0, 0]).mean() > DOME.max_unsolved_share:
        raise BadCalibration(f'simulated presses to {plan.depth * 1e3:.1f} mm with {material} do not converge; check dome and depths')
    pushes = [np.repeat(np.reshape([getattr(one, name) for one in pressed], (*shape, 1, 3, 1)), 2, axis=4)
              for name in ('push', 'push_along', 'push_across')]
    return DomeLibrary(plan, material, _assembled(plan, mesh, fields), _assembled(plan, UNIFORM, pushes))


def _assembled(plan: DomePlan, mesh: MeshPlan, fields: list[np.ndarray]) -> DomeTable:
    """Make the table of straight presses, drags along and across, (order, tips, frictions, levels, rings + 1, 3, harmonics + 1) each."""
    straight, *drags = fields
    rubs, sticks = range(len(FRICTIONS))
    kinds = [_filled(part, plan) for part in np.moveaxis(straight, 2, 0)]
    even = [_mirrored(part, odd=False, turned=False) for part in kinds]
    reduced = []
    for part, odd in zip(drags, (False, True)):
        stuck, rubbed = (_filled(part[:, :, k], plan) for k in (sticks, rubs))
        reduced.append([_mirrored(kind, odd=odd, turned=not odd) for kind in (stuck, rubbed - stuck)])
    return DomeTable(mesh, *_reduced(even + reduced[0], plan), *_reduced(reduced[1], plan))


def _pressed(plan: DomePlan, material: DomeMaterial, mesh_plan: MeshPlan, case: tuple[float, float, float]) -> PressedDome:
    """Apparent fields at the levels of one press; case: shift of the mesh, log radius over the spread, and friction number."""
    shift, radius, friction = case
    mesh = DomeMesh(shift, plan.cap, mesh_plan)
    rough = replace(material, friction=material.friction * (1 + friction))
    found = press_dome(mesh, plan.load_steps, plan.radius * np.exp(DOME.radius_spread * radius), rough, drags=plan.substeps)
    level = slice(plan.substeps - 1, None, plan.substeps)
    shown = AsSeen(mesh, plan.marker, plan.camera_centre).fields(found.straight[level], found.along[level], found.across[level])
    return PressedDome(*shown, found.push[level], found.push_along[level], found.push_across[level])


class AsSeen:
    """Converts fields of a mesh to the apparent displacement of markers of radius marker, m.

    Along the axis it is the mean over the marker; laterally it is the motion of the centroid in the view of a camera on the axis at the
    height camera_centre, m.
    """

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
        """Fields of PressedDome, (D, size) each; drags are linearised at DOME.drag of their displacement."""
        shown = np.full((3, *straight.shape), np.nan)
        for k in np.flatnonzero(np.isfinite(straight[:, 0])):
            base = self._displaced(straight[k], False)
            shown[0, k] = self._field(self._shown(base), False)
            for kind, field in ((1, along[k]), (2, across[k])):
                aside = DOME.drag * self._displaced(field, kind == 2)
                shown[kind, k] = self._field(self._shown(base + aside) - self._shown(base - aside), kind == 2) / (2 * DOME.drag)
        return tuple(shown)

    def _displaced(self, field: np.ndarray, odd: bool) -> np.ndarray:
        """Displacements (N, C + 1, 3), m, of the outlines under a field (size,)."""
        return self._on_mesh.displaced(field, odd).reshape(self._outlines.shape)

    def _shown(self, moved: np.ndarray) -> np.ndarray:
        """Apparent displacements (N, 3), m, of markers whose outlines moved by (N, C + 1, 3), m."""
        edge = 0.5 / DOME.outline_stretch**2  # weight of the outline in the mean over a disc, which makes it exact to cubic terms
        up = (1 - edge) * moved[:, 0, 2] + edge * moved[:, 1:, 2].mean(axis=1)
        seen = self._still + appear_at(self._outlines + moved, self._camera_centre)
        aside = seen * (self._points[:, 2] + up - self._camera_centre[2])[:, None] - self._points[:, :2]
        return np.column_stack([aside, up])

    def _field(self, shown: np.ndarray, odd: bool) -> np.ndarray:
        """Field (size,) of displacements (N, 3) at the rings and directions of the mesh."""
        at = shown.reshape(self._mesh.n + 1, -1, 3)
        field = np.stack([at[..., axis] @ self._onto[(axis == 1) != odd] for axis in range(3)], axis=1)
        return np.where(self._mesh.free[odd], field.ravel(), 0.0)


def _filled(fields: np.ndarray, plan: DomePlan) -> np.ndarray:
    """Fields (order, tips, levels + 1, ...) with the untouched one; NaN is extrapolated over depth."""
    whole = np.concatenate([np.zeros_like(fields[:, :, :1]), fields], axis=2)
    extrapolate(whole.reshape(-1, *whole.shape[2:]), np.concatenate([[0.0], plan.load_steps[plan.substeps - 1::plan.substeps]]))
    return np.nan_to_num(whole)


def _mirrored(fields: np.ndarray, odd: bool, turned: bool) -> np.ndarray:
    """Add the fields of presses mirrored along x: (2 order, ...).

    odd: whether the fields are odd; turned: whether the mirror inverts their direction.
    """
    order = np.arange(fields.shape[-1])
    # cos m (pi - phi) = (-1)^m cos m phi, sin m (pi - phi) = -(-1)^m sin m phi; the mirror inverts x.
    sign = (-1.0)**order * (np.array([[-1.0], [-1.0], [1.0]]) if not odd else np.array([[1.0], [1.0], [-1.0]]))
    return np.concatenate([fields, fields[::-1] * (-sign if turned else sign)])


def _reduced(kinds: list[np.ndarray], plan: DomePlan) -> tuple[np.ndarray, np.ndarray]:
    """Table and modes of kinds of fields (2 order, tips, levels + 1, rings + 1, 3, harmonics + 1)."""
    shape = kinds[0].shape
    snapshots = np.reshape(kinds, (-1, int(np.prod(shape[3:]))))
    _, strength, modes = np.linalg.svd(snapshots, full_matrices=False)
    modes = modes[:max(1, int(np.sum(strength > DOME.min_mode_rms * np.sqrt(snapshots.size))))]
    mixed = np.reshape(snapshots @ modes.T, (len(kinds), *shape[:3], len(modes)))
    if len(kinds) > len(FRICTIONS):  # straight presses by powers of the friction number
        powers = np.linalg.inv(np.vander(FRICTIONS, increasing=True))
        mixed[:len(FRICTIONS)] = np.einsum('pf,fabcm->pabcm', powers, mixed[:len(FRICTIONS)])
    angle = (2 * np.arange(2 * plan.order) + 1) * np.pi / (4 * plan.order)
    over_shift = np.linalg.inv(np.cos(np.outer(angle, np.arange(2 * plan.order))))
    over_radius = np.linalg.inv(np.vander(np.linspace(-1, 1, DOME.tips), increasing=True))
    table = np.einsum('ai,cj,dl,kijlm->dkacm', over_shift, over_radius, spline_fit(plan.levels), mixed, optimize=True)
    return tuple(np.ascontiguousarray(part, np.float32) for part in (table, modes.reshape(len(modes), *shape[3:])))

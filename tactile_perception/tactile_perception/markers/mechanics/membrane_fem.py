# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Finite elements of a sheet pressed by a round tip: incompressible neo-Hookean membrane, prestretched and clamped, with bending.

Lengths in m; energies per shear modulus times thickness, which scales the force but not the displacement.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ...errors import BadArgument
from .mesh import SheetMesh

STIFF = 4e7     # 1/m^3, penalty stiffness of contact: penetration is a few micrometres
STICK = 4e7     # 1/m^3, penalty stiffness of sticking friction. Chosen: as STIFF
SOFT = 10e-6     # m: half width of the transition into contact, which smooths the penalty. Chosen
STEPS = 24      # Newton steps at most, before the load step is halved. Chosen
WHOLE = 9       # first Newton steps in full length; later ones are halved, which ends cycles of stick and slip. Chosen
HALVINGS = 6    # of a load step, at most. Chosen
SETTLED = 1e-6  # m: largest last Newton step. Chosen: far below the noise of a marker
STRIDE = 1.5e-3  # m: limit of a Newton step. Chosen


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


@dataclass
class _Touch:
    """Contact at the integration points: which are in contact (E, 4), pressure and friction, and their tangent (E, 4, 3, 3)."""

    on: np.ndarray
    force: np.ndarray
    stick_place: np.ndarray
    tangent: np.ndarray


def press_sheet(mesh: SheetMesh, depths: np.ndarray, radius: float, material: SheetMaterial) -> np.ndarray:
    """Displacement coefficients (D, side * side, 3), m, of the sheet pressed by a tip of radius, m, to each of the rising depths (D,), m.

    The tip comes straight down at mesh.place; friction depends on the path. NaN from the first depth that does not converge.
    """
    return _Press(mesh, radius, material).path(np.asarray(depths, float))


class _Press:
    """One press, by load steps."""

    def __init__(self, mesh: SheetMesh, radius: float, material: SheetMaterial):
        self._mesh, self._radius, self._material = mesh, radius, material
        self._squeeze = material.prestretch**-6
        bend = np.einsum('eg,egi,egj->eij', mesh.weight * material.bending, mesh.laplacian, mesh.laplacian)
        self._bend = np.einsum('eij,kl->eikjl', bend, np.eye(3)).reshape(-1, 27, 27)
        self._flat = mesh.slope.reshape(len(mesh.nodes), 8, 9)
        self._u = np.zeros((mesh.side**2, 3))
        self._last, self._before, self._depth = self._u, 0.0, 0.0
        self._held = np.zeros(mesh.weight.shape, bool)
        self._anchor = np.zeros(mesh.weight.shape + (3,))

    def path(self, depths: np.ndarray) -> np.ndarray:
        """Displacements (D, ...), m, at rising depths (D,), m; NaN from the first that does not converge."""
        fields = np.full((len(depths),) + self._u.shape, np.nan)
        for k, depth in enumerate(depths):
            if not self._reach(depth, HALVINGS):
                break
            fields[k] = self._u
        return fields

    def _reach(self, depth: float, halvings: int) -> bool:
        """Load step to depth from an extrapolated start, or in two halves; False where it does not converge."""
        start, at = self._u.copy(), self._depth
        if at > self._before:
            self._u = start + (start - self._last) * min((depth - at) / (at - self._before), 2.0)
        if self._settle(depth):
            self._last, self._before, self._depth = start, at, depth
            return True
        self._u = start
        return halvings > 0 and self._reach((at + depth) / 2, halvings - 1) and self._reach(depth, halvings - 1)

    def _settle(self, depth: float) -> bool:
        """Newton's method for equilibrium at depth; False where it does not converge."""
        centre = np.array([*self._mesh.place, self._radius - depth])
        for turn in range(STEPS):
            residual, matrix, touch = self._balance(centre)
            step = splu(matrix, permc_spec='MMD_AT_PLUS_A', diag_pivot_thresh=0.0, options={'SymmetricMode': True}).solve(-residual)
            largest = np.abs(step).max()
            if not np.isfinite(largest):
                return False
            self._u.reshape(-1)[self._mesh.free] += step * min(1.0 if turn < WHOLE else 0.5, STRIDE / max(largest, 1e-12))
            if largest < SETTLED:
                self._held, self._anchor = touch.on, np.where(touch.on[..., None], touch.stick_place, 0.0)
                return True
        return False

    def _balance(self, centre: np.ndarray) -> tuple[np.ndarray, csc_matrix, _Touch]:
        mesh, count = self._mesh, len(self._mesh.nodes)
        u = self._u[mesh.nodes]
        edges = np.matmul(self._flat, u).reshape(count, 4, 2, 3) + np.eye(2, 3)
        stress, tangent = _membrane(edges, self._squeeze)
        stress, tangent = stress * mesh.weight[..., None, None], tangent * mesh.weight[..., None, None, None, None]
        touch = self._touch(np.matmul(mesh.value, u) + np.concatenate([mesh.rest, np.zeros(mesh.weight.shape + (1,))], -1) - centre)
        force = np.matmul(self._flat.transpose(0, 2, 1), stress.reshape(count, 8, 3))
        force += np.matmul(mesh.value.transpose(0, 2, 1), touch.force * mesh.weight[..., None])
        force = force.reshape(count, 27) + np.matmul(self._bend, u.reshape(count, 27, 1))[..., 0]
        residual = np.bincount(mesh.unknowns.ravel(), force.ravel(), 3 * mesh.side**2)[mesh.free]
        return residual, self._matrix(tangent, touch), touch

    def _matrix(self, tangent: np.ndarray, touch: _Touch) -> csc_matrix:
        mesh, count = self._mesh, len(self._mesh.nodes)
        left = np.matmul(mesh.slope.transpose(0, 1, 3, 2), tangent.reshape(count, 4, 2, 18)).reshape(count, 4, 9, 3, 2, 3)
        left = left.transpose(0, 2, 3, 5, 1, 4).reshape(count, 81, 8)
        element = np.matmul(left, self._flat).reshape(count, 9, 3, 3, 9).transpose(0, 1, 2, 4, 3).reshape(count, 27, 27) + self._bend
        under = np.flatnonzero(touch.on.any(1))
        value, pressed = mesh.value[under], touch.tangent[under] * mesh.weight[under][..., None, None]
        element[under] += np.einsum('egi,egkl,egj->eikjl', value, pressed, value, optimize=True).reshape(-1, 27, 27)
        data = np.bincount(mesh.slot, element.reshape(-1)[mesh.kept], len(mesh.indices))
        return csc_matrix((data, mesh.indices, mesh.indptr), (len(mesh.free),) * 2)

    def _touch(self, offset: np.ndarray) -> _Touch:
        """Contact pressure and Coulomb friction (return mapping, elastic stick) at points offset (E, 4, 3), m, from the tip's centre."""
        distance = np.linalg.norm(offset, axis=-1)
        on = distance < self._radius + SOFT
        q, r = offset[on], distance[on][:, None]
        depth = self._radius + SOFT - r
        normal, stiff = q / r, STIFF * np.minimum(depth / (2 * SOFT), 1.0)
        pressure = np.where(depth < 2 * SOFT, stiff * depth / 2, STIFF * (depth - SOFT))
        held = self._held[on][:, None]
        slid = np.where(held, q - self._anchor[on], 0.0)
        slid -= np.sum(slid * normal, 1, keepdims=True) * normal
        amount = np.linalg.norm(slid, axis=1, keepdims=True)
        limit = self._material.friction * pressure
        part = np.where(STICK * amount > limit, limit / np.maximum(STICK * amount, 1e-30), 1.0)
        friction = STICK * part * slid
        along, flat = slid / np.maximum(amount, 1e-30), np.eye(3) - _outer(normal, normal)
        slips = (part < 1)[..., None]
        tangent = stiff[..., None] * _outer(normal, normal) - (pressure / r)[..., None] * flat + STICK * (part * held)[..., None] * flat
        sliding = STICK * part[..., None] * _outer(along, along) + self._material.friction * stiff[..., None] * _outer(along, normal)
        tangent -= np.where(slips, sliding, 0)
        touch = _Touch(on, np.zeros_like(offset), np.zeros_like(offset), np.zeros(offset.shape + (3,)))
        touch.force[on], touch.stick_place[on], touch.tangent[on] = friction - pressure * normal, q - friction / STICK, tangent
        return touch


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., :, None] * b[..., None, :]


def _membrane(edges: np.ndarray, squeeze: float) -> tuple[np.ndarray, np.ndarray]:
    """Stress (E, 4, 2, 3) and tangent (E, 4, 2, 3, 2, 3) of the energy (|a|^2 + |b|^2 + squeeze / |a x b|^2) / 2 by its edges.

    edges (E, 4, 2, 3): a and b, the derivatives of the sheet's position by x and y; squeeze = prestretch^-6: incompressible thinning.
    """
    a, b = edges[..., 0, :], edges[..., 1, :]
    aa, bb, ab = (np.sum(p * q, -1)[..., None] for p, q in ((a, a), (b, b), (a, b)))
    area = aa * bb - ab**2
    by_a, by_b = 2 * (bb * a - ab * b), 2 * (aa * b - ab * a)
    first, second = (squeeze / area**2 / 2), (squeeze / area**3)[..., None]
    stress = np.stack([a - first * by_a, b - first * by_b], axis=-2)
    eye, first = np.eye(3), first[..., None]
    tangent = np.empty(edges.shape + (2, 3))
    tangent[..., 0, :, 0, :] = eye - 2 * first * (bb[..., None] * eye - _outer(b, b)) + second * _outer(by_a, by_a)
    tangent[..., 1, :, 1, :] = eye - 2 * first * (aa[..., None] * eye - _outer(a, a)) + second * _outer(by_b, by_b)
    mixed = -2 * first * (2 * _outer(a, b) - _outer(b, a) - ab[..., None] * eye) + second * _outer(by_a, by_b)
    tangent[..., 0, :, 1, :], tangent[..., 1, :, 0, :] = mixed, np.swapaxes(mixed, -1, -2)
    return stress, tangent

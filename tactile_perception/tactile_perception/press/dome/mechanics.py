# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Equilibrium of an inflated dome under a round tip, on a polar mesh that is centred where the tip touches."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.geometry import Cap
from ...errors import BadArgument
from ..sensor import MarkerSensor, dome_cap, rest_points

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


@dataclass(frozen=True)
class MeshPlan:
    """even: rings of equal width at the touch; rings: in all; width: of the even ones, of the unit disc; harmonics: highest; around:
    integration points along half a circle. Chosen: under a press of 34 mm on a dome of 120 mm, markers are within 0.03 mm (40 mm off the
    axis) and 0.04 mm (70 mm off) of those of a mesh with rings of half the width and seven harmonics; with 28 rings and four harmonics
    0.05 and 0.12 mm. Far rings count, because the gas makes all of the skin bulge.
    """

    even: int = 12
    rings: int = 36
    width: float = 0.0125
    harmonics: int = 5
    around: int = 12

    @property
    def size(self) -> int:
        """Coefficients of a field: three components of cosines or sines on each ring and in the centre."""
        return (self.rings + 1) * 3 * (self.harmonics + 1)

    @property
    def edges(self) -> np.ndarray:
        """(rings + 1,) radii of the rings in the unit disc, from 0 to 1: even, then growing by a constant factor."""
        left, count = 1 - self.even * self.width, self.rings - self.even
        low, high = 1.0, 3.0
        for _ in range(60):
            factor = (low + high) / 2
            low, high = (factor, high) if self.width * np.sum(factor**np.arange(1, count + 1)) < left else (low, factor)
        widths = np.concatenate([np.full(self.even, self.width), self.width * low**np.arange(1, count + 1)])
        return np.concatenate([[0.0], np.cumsum(widths)]) / widths.sum()


def disc_scale(cap: Cap) -> float:
    """Radius of the stereographic projection of a cap's rim: the tangent of half the rim's angle from the pole."""
    return float(np.tan(np.arctan2(cap.rim_radius, -cap.centre_z) / 2))


def disc_of(points: np.ndarray, cap: Cap) -> np.ndarray:
    """(K,) complex: places in the unit disc of points (K, 3), m, on the cap."""
    return (points[:, 0] + 1j * points[:, 1]) / ((cap.curvature_radius + points[:, 2] - cap.centre_z) * disc_scale(cap))


def shift_of(across: float, tip_radius: float, cap: Cap) -> float:
    """The automorphism's a for a tip of tip_radius, m, whose centre is across, m, from the dome's axis as it first touches."""
    angle = np.arcsin(min(across / (cap.curvature_radius + tip_radius), 0.99))
    return float(np.tan(angle / 2) / disc_scale(cap))


class DomeMesh:
    """The mesh of a touch with the automorphism's shift on a cap.

    At P points in each of n ring elements: rest (n, P, 3), m, and its derivatives along the radius and along the circle, scale (n, P), m:
    length per length in the disc, weight (n, P): area in the disc. Coefficients of a field are (rings + 1, 3, harmonics + 1); even
    fields are mirror symmetric to the meridian plane (x: cosines, y: sines, z: cosines), odd ones antisymmetric.
    """

    def __init__(self, shift: float, cap: Cap, plan: MeshPlan):
        self.shift, self.cap, self.plan = shift, cap, plan
        self.n, self.per_ring = plan.rings, 3 * (plan.harmonics + 1)
        edges, phi = plan.edges, (np.arange(plan.around) + 0.5) * np.pi / plan.around
        low, width = edges[:-1, None], np.diff(edges)[:, None]
        radius = low + width * (1 + GAUSS) / 2
        self._radius, self._phi = radius, phi
        self._share = np.stack([1 - (1 + GAUSS) / 2, (1 + GAUSS) / 2], axis=-1), np.array([-1.0, 1.0]) / width
        weight = width / 2 * radius * np.pi / plan.around
        self.weight = np.repeat(weight[:, :, None], plan.around, axis=2).reshape(self.n, -1)
        z = (radius[:, :, None] * np.exp(1j * phi)).reshape(self.n, -1)
        self._place(z)
        self.of = np.arange(self.n)[:, None] * self.per_ring + np.arange(2 * self.per_ring)

    def _place(self, z: np.ndarray) -> None:
        """Places of the points z of the disc, and their derivatives along the radius and along the circle."""
        scale, along = disc_scale(self.cap), z / np.abs(z)
        moved = self._projected(z)
        slope = scale * (1 - self.shift**2) / (1 + self.shift * z)**2 * along
        square, size = np.abs(moved)**2, self.cap.curvature_radius
        self.rest = self.points(z)
        self.scale = 2 * size * np.abs(slope) / (1 + square)
        self.along, self.across = (self._pushed(moved, way, square) * size for way in (slope, 1j * slope))

    def _projected(self, z: np.ndarray) -> np.ndarray:
        """Stereographic projections of the points z of the disc."""
        return disc_scale(self.cap) * (z + self.shift) / (1 + self.shift * z)

    def points(self, z: np.ndarray) -> np.ndarray:
        """(..., 3) m: the places on the cap of points z (...) of the disc, complex."""
        moved = self._projected(z)
        square = np.abs(moved)**2
        unit = _stacked(2 * moved / (1 + square), 2 / (1 + square) - 1)
        return unit * self.cap.curvature_radius + [0.0, 0.0, self.cap.centre_z]

    @staticmethod
    def _pushed(at: np.ndarray, way: np.ndarray, square: np.ndarray) -> np.ndarray:
        """Derivative of the inverse stereographic projection onto the unit sphere at a place along a way, both complex."""
        grows = 2 * (at * way.conj()).real
        return _stacked(2 * way / (1 + square) - 2 * at * grows / (1 + square)**2, -2 * grows / (1 + square)**2)

    def basis(self, odd: bool) -> tuple[np.ndarray, np.ndarray]:
        """Of the coefficients of two neighbouring rings at the points: value (n, 3 P, D), and derivatives (n, 6 P, D) along the radius and
        along the circle, component by component.
        """
        order, shape = np.arange(self.plan.harmonics + 1), (self.n, 2, self.plan.around, 3, 2, 3, self.plan.harmonics + 1)
        cos, sin = (function(np.outer(self._phi, order)) for function in (np.cos, np.sin))
        near, slope = self._share[0][None, :, None, :, None], self._share[1][:, None, None, :, None]
        value, along, across = (np.zeros(shape) for _ in range(3))
        for axis in range(3):
            wave, turned = (sin, order * cos) if (axis == 1) != odd else (cos, -order * sin)
            wave, turned = wave[None, None, :, None], turned[None, None, :, None]
            value[..., axis, :, axis, :] = near * wave
            along[..., axis, :, axis, :] = slope * wave
            across[..., axis, :, axis, :] = near * turned / self._radius[:, :, None, None, None]
        rows = self.n, 3 * self.weight.shape[1], 2 * self.per_ring
        return value.reshape(rows), np.stack([along, across], axis=3).reshape(rows[0], 2 * rows[1], rows[2])

    def free(self, odd: bool) -> np.ndarray:
        """(size,) bool: coefficients that are not zero: none at the rim, the zeroth harmonic alone in the centre, no sine of zero."""
        free = np.ones((self.n + 1, 3, self.plan.harmonics + 1), bool)
        free[-1] = free[0, :, 1:] = False
        free[:, [0, 2] if odd else [1], 0] = False
        return free.ravel()


def _stacked(flat: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(..., 3) from x + i y and z."""
    return np.stack([flat.real, flat.imag, up], axis=-1)


def evaluate(field: np.ndarray, mesh: DomeMesh, points: np.ndarray, odd: bool = False) -> np.ndarray:
    """(K, 3) displacement, m, of a field (size,) at points (K, 3), m, on the cap."""
    w = disc_of(points, mesh.cap)
    z = (w - mesh.shift) / (1 - mesh.shift * w)
    edges, radius, turn = mesh.plan.edges, np.abs(z), np.angle(z)
    low = np.clip(np.searchsorted(edges, radius) - 1, 0, mesh.n - 1)
    part = ((radius - edges[low]) / (edges[low + 1] - edges[low]))[:, None, None]
    rings = field.reshape(mesh.n + 1, 3, -1)
    here = rings[low] * (1 - part) + rings[low + 1] * part
    phase = np.outer(turn, np.arange(mesh.plan.harmonics + 1))
    moved = np.stack([(here[:, axis] * (np.sin(phase) if (axis == 1) != odd else np.cos(phase))).sum(1) for axis in range(3)], axis=1)
    return np.where(radius[:, None] <= 1, moved, 0.0)


STIFF = 4e6      # 1/m^2 times the tension over G, penalty stiffness of contact: penetration is some ten micrometres. Chosen
SOFT = 10e-6     # m: half width of the transition into contact. Chosen
STEPS = 24       # Newton steps at most, before the load step is halved. Chosen
WHOLE = 12       # first Newton steps in full length; later ones are halved, which ends cycles of stick and slip. Chosen
HALVINGS = 4     # of a load step, at most. Chosen
SETTLED = 2e-6   # m: largest last Newton step. Chosen: far below the noise of a marker
STRIDE = 2e-3    # m: limit of a Newton step. Chosen


@dataclass(frozen=True)
class DomeMaterial:
    """squeeze: prestretch^-6, by which a stretched skin is weaker than a soap film of the same tension; gas: relative growth of the
    pressure over relative loss of volume, 0 for a pressure that is held; friction: coefficient between tip and skin. Raises BadArgument
    for numbers out of range.
    """

    squeeze: float = 0.5
    gas: float = 50.0
    friction: float = 0.5

    def __post_init__(self):
        if not (0 <= self.squeeze < 1 and 0 <= self.gas < 1e4 and 0 <= self.friction < 10):
            raise BadArgument(f'dome material: need 0 <= squeeze < 1, 0 <= gas < 1e4 and 0 <= friction < 10, got {self}')


@dataclass
class _Touch:
    """Contact at the points: which are in contact (n, P), force and place of sticking (n, P, 3), tangent (n, P, 3, 3), and that where all
    of it sticks."""

    on: np.ndarray
    force: np.ndarray
    stick_place: np.ndarray
    tangent: np.ndarray
    stuck: np.ndarray


@dataclass(frozen=True)
class PressedDome:
    """Fields of one tip at D depths: straight (D, size): displacement; along, across (D, size), even and odd: by a tip that carries
    the skin as far aside as it is deep, along the meridian and across it; push, push_along, push_across (D, 3): forces of the tip, over G,
    that belong to them. NaN from the first depth without convergence, and where not wanted."""

    straight: np.ndarray
    along: np.ndarray
    across: np.ndarray
    push: np.ndarray
    push_along: np.ndarray
    push_across: np.ndarray


def press_dome(mesh: DomeMesh, depths: np.ndarray, radius: float, material: DomeMaterial, drags: int = 1) -> PressedDome:
    """Press a tip of radius, m, straight down at the mesh's centre to rising depths (D,), m; friction depends on the path. drags:
    every so many depths along and across are wanted, 0 for never."""
    return _Press(mesh, radius, material).path(np.asarray(depths, float), drags)


class _Press:
    """One press, by load steps."""

    def __init__(self, mesh: DomeMesh, radius: float, material: DomeMaterial):
        self._mesh, self._radius, self._material = mesh, radius, material
        self._value, self._slopes = mesh.basis(odd=False)
        self._free, self._u = mesh.free(odd=False), np.zeros(mesh.plan.size)
        self._stiff = STIFF * (1 - material.squeeze)
        cap = mesh.cap
        self._pressure, self._volume, self._bias = 2 * (1 - material.squeeze) / cap.curvature_radius, 0.0, 0.0
        pull, push, self._volume, _ = self._membrane()
        self._bias = pull - self._pressure * push  # of the discretisation: the sphere is the exact equilibrium
        at = np.array([0.0, 0.0, cap.centre_z])
        angle = 2 * np.arctan(mesh.shift * disc_scale(cap))
        self._first = at + np.array([np.sin(angle), 0.0, np.cos(angle)]) * (cap.curvature_radius + radius)
        self._settled = np.zeros(mesh.weight.shape, bool), np.zeros(mesh.rest.shape), self._first, self._places() - self._first

    def path(self, depths: np.ndarray, drags: int) -> PressedDome:
        """See press_dome."""
        found = PressedDome(*(np.full((len(depths), size), np.nan) for size in (*[self._mesh.plan.size] * 3, 3, 3, 3)))
        last, before, at = self._u, 0.0, 0.0
        for k, depth in enumerate(depths):
            start = self._u
            if at > before:
                self._u = start + (start - last) * min((depth - at) / (at - before), 2.0)
            if not self._reach(at, depth, start, HALVINGS):
                break
            last, before, at = start, at, depth
            found.straight[k], found.push[k] = self._u, self._push()
            if drags and (k + 1) % drags == 0:
                found.along[k], found.push_along[k] = self._dragged(0, depth)
                found.across[k], found.push_across[k] = self._dragged(1, depth)
        return found

    def _reach(self, at: float, depth: float, start: np.ndarray, halvings: int) -> bool:
        """Settle at depth, or go there from at by two halves; False where it does not converge."""
        if self._settle(depth):
            return True
        self._u = start
        if halvings == 0 or not self._reach(at, (at + depth) / 2, start, halvings - 1):
            return False
        return self._reach((at + depth) / 2, depth, self._u, halvings - 1)

    def _settle(self, depth: float) -> bool:
        """Newton's method for equilibrium at depth; False where it does not converge."""
        centre = self._first - [0.0, 0.0, depth]
        self._held, self._anchor = self._met(centre)
        for turn in range(STEPS):
            residual, push, touch, tangents, softer = self._balance(centre)
            self._tangents, self._swelling, self._softer = tangents, push, softer
            step = self._with_gas(tangents, -residual, push, self._value, self._slopes, self._free)
            if not np.isfinite(step).all():
                return False
            largest = np.abs(step).max()
            self._u = self._u + step * min(1.0 if turn < WHOLE else 0.5, STRIDE / max(largest, 1e-12))
            if largest < SETTLED:
                self._settled = touch.on, np.where(touch.on[..., None], touch.stick_place, 0.0), centre, self._places() - centre
                self._touching = touch
                return True
        return False

    def _met(self, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which points stick (n, P), and their places (n, P, 3) from the tip's centre, as the tip goes from where it settled to centre.

        Those that stuck, and those that it meets on its way, were the skin at rest meanwhile. A point that stuck at the end of its first
        step alone would slip by a part of that step.
        """
        held, anchor, before, offset = self._settled
        down, up = before[2] - centre[2], -offset[..., 2]
        root = up**2 - np.sum(offset**2, axis=-1) + (self._radius + SOFT)**2
        way = np.clip(up - np.sqrt(np.maximum(root, 0.0)), 0.0, None)
        meets = ~held & (root > 0) & (way < down)
        return held | meets, np.where(meets[..., None], offset + way[..., None] * [0.0, 0.0, 1.0], anchor)

    def _balance(self, centre: np.ndarray):
        """Residual force (size,); derivative of the volume by the coefficients (size,); contact; tangents at the points (for _solved);
        derivative of the pressure by the volume."""
        pull, push, volume, (along, across, normal) = self._membrane()
        share = self._volume / volume
        pressure = self._pressure * (1 + self._material.gas * (share - 1))
        touch = self._touch(self._places() - centre)
        area = (self._mesh.weight * self._mesh.scale**2)[..., None]
        residual = np.where(self._free, pull - pressure * push - self._bias + self._gathered(self._value, touch.force * area), 0.0)
        stress = _membrane_tangent(along, across, normal, self._squeeze()) * self._mesh.weight[..., None, None]
        swell = np.concatenate([-_cross_matrix(across), _cross_matrix(along)], axis=-1) * (-pressure * self._mesh.weight)[..., None, None]
        tangents = stress, swell, touch.tangent * area[..., None]
        return residual, np.where(self._free, push, 0.0), touch, tangents, -2 * self._pressure * self._material.gas * share / volume

    def _membrane(self):
        """Force of the skin (size,), derivative of half the volume (size,), the volume, m^3, and the skin's edges and normal."""
        mesh = self._mesh
        edges = np.matmul(self._slopes, self._u[mesh.of][..., None]).reshape(mesh.n, -1, 2, 3)
        along, across = mesh.along + edges[..., 0, :], mesh.across + edges[..., 1, :]
        normal = np.cross(along, across)
        thinning = self._squeeze()[..., None] / np.sum(normal**2, axis=-1, keepdims=True)**2
        stress = np.stack([along - thinning * np.cross(across, normal), across - thinning * np.cross(normal, along)], axis=2)
        volume = 2 / 3 * np.sum(mesh.weight * np.sum(self._places() * normal, axis=-1))
        push = self._gathered(self._value, normal * mesh.weight[..., None])
        return self._gathered(self._slopes, stress * mesh.weight[..., None, None]), push, volume, (along, across, normal)

    def _squeeze(self) -> np.ndarray:
        """(n, P) of the edges per length in the disc."""
        return self._material.squeeze * self._mesh.scale**6

    def _places(self) -> np.ndarray:
        return self._mesh.rest + np.matmul(self._value, self._u[self._mesh.of][..., None]).reshape(self._mesh.rest.shape)

    def _gathered(self, basis: np.ndarray, at_points: np.ndarray) -> np.ndarray:
        """(size,) sums over the points."""
        local = np.matmul(at_points.reshape(len(basis), 1, -1), basis)
        return np.bincount(self._mesh.of.ravel(), local.ravel(), self._mesh.plan.size)

    def _solved(self, tangents, right: np.ndarray, value: np.ndarray, slopes: np.ndarray, free: np.ndarray) -> np.ndarray:
        """(size, m): solutions for right (size, m), by the band that rings and their neighbours form."""
        from scipy.linalg import solve_banded  # calibration alone needs it
        mesh = self._mesh
        stress, swell, touch = tangents
        parts = slopes.reshape(mesh.n, -1, 6, slopes.shape[-1]), value.reshape(mesh.n, -1, 3, value.shape[-1])
        pulled = np.matmul(stress, parts[0]).reshape(slopes.shape)
        pushed = (np.matmul(swell, parts[0]) + np.matmul(touch, parts[1])).reshape(value.shape)
        element = np.matmul(slopes.transpose(0, 2, 1), pulled) + np.matmul(value.transpose(0, 2, 1), pushed)
        size, wide = mesh.plan.size, 2 * mesh.per_ring - 1
        row, column = np.broadcast_arrays(mesh.of[:, :, None], mesh.of[:, None, :])
        element = np.where(free[row] & free[column], element, 0.0)
        band = np.bincount(((wide + row - column) * size + column).ravel(), element.ravel(), (2 * wide + 1) * size)
        band = band.reshape(2 * wide + 1, size)
        band[wide, ~free] = 1.0
        return solve_banded((wide, wide), band, np.where(free[:, None], right, 0.0), check_finite=False)

    def _with_gas(self, tangents, right: np.ndarray, push: np.ndarray, value: np.ndarray, slopes: np.ndarray,
                  free: np.ndarray) -> np.ndarray:
        """(size,): solution for right (size,). The gas couples all points: its tangent is a product of two vectors push (size,) (Sherman
        and Morrison 1950)."""
        found = self._solved(tangents, np.stack([right, push], axis=1), value, slopes, free)
        return found[:, 0] + found[:, 1] * (self._softer * (push @ found[:, 0]) / (1 - self._softer * (push @ found[:, 1])))

    def _dragged(self, axis: int, way: float) -> tuple[np.ndarray, np.ndarray]:
        """(size,) displacement where the tip goes by way, m, along x or y and carries the skin as far; and the change (3,) of the force of
        the tip. The skin sticks to it; without friction, traction in proportion to the pressure carries it, as of a tip in gross slip.

        Linear, and yet near for a long way: the part of the skin in contact moves as one, and an ideal balloon answers linearly.
        """
        odd, aside = axis == 1, np.eye(3)[axis] * way
        value, slopes = (self._value, self._slopes) if not odd else self._mesh.basis(odd=True)
        area, free = (self._mesh.weight * self._mesh.scale**2)[..., None], self._mesh.free(odd)
        push = np.zeros_like(self._u) if odd else self._swelling  # mirror symmetry keeps the gas out of the odd field
        rubs = self._material.friction == 0
        held = (self._touching.tangent if rubs else self._touching.stuck) * area[..., None]

        def answer(load):
            return self._with_gas((*self._tangents[:2], held), self._gathered(value, load) * free, push, value, slopes, free)

        def at_points(field):
            return np.matmul(value, field[self._mesh.of][..., None]).reshape(self._mesh.rest.shape)

        moved, traction = answer(held @ aside), 0.0
        if rubs:
            normal = self._touching.force * area  # of the skin on the tip, outwards from it
            size = np.linalg.norm(normal, axis=-1, keepdims=True)
            along = size * aside - normal * (normal @ aside)[..., None] / np.maximum(size, 1e-30)
            more = answer(along)
            weight = size / size.sum()
            lacks, gives = (np.sum(weight * (part @ aside)[..., None]) for part in (aside - at_points(moved), at_points(more)))
            moved, traction = moved + more * (lacks / gives), along * (lacks / gives)
        force = np.sum(np.matmul(held, (aside - at_points(moved))[..., None])[..., 0] + traction, axis=(0, 1))
        return moved, 2 * force * ([0.0, 1.0, 0.0] if odd else [1.0, 0.0, 1.0])

    def _push(self) -> np.ndarray:
        """(3,) force of the tip on the skin, both halves."""
        area = (self._mesh.weight * self._mesh.scale**2)[..., None]
        return -2 * np.sum(self._touching.force * area, axis=(0, 1)) * [1.0, 0.0, 1.0]

    def _touch(self, offset: np.ndarray) -> _Touch:
        """Contact pressure and Coulomb friction (return mapping, elastic stick) at points offset (n, P, 3), m, from the tip's centre."""
        distance = np.linalg.norm(offset, axis=-1)
        normal, deep, friction = offset / distance[..., None], self._radius + SOFT - distance, self._material.friction
        on, held = deep > 0, self._held & (deep > 0)
        stiff = self._stiff * np.clip(deep / (2 * SOFT), 0, 1)
        pressure = np.where(on, np.where(deep < 2 * SOFT, stiff * deep / 2, self._stiff * (deep - SOFT)), 0.0)
        slid = np.where(held[..., None], offset - self._anchor, 0.0)
        slid -= np.sum(slid * normal, axis=-1, keepdims=True) * normal
        amount, stick = np.linalg.norm(slid, axis=-1), self._stiff / 2
        part = np.where(stick * amount > friction * pressure, friction * pressure / np.maximum(stick * amount, 1e-30), 1.0)
        rub = stick * part[..., None] * slid
        way, up = slid / np.maximum(amount, 1e-30)[..., None], normal[..., :, None] * normal[..., None, :]
        flat, sticks = np.eye(3) - up, stick * part
        stuck = stiff[..., None, None] * up + (stick - pressure / distance)[..., None, None] * flat
        tangent = stiff[..., None, None] * up + (sticks * held - pressure / distance)[..., None, None] * flat
        sliding = sticks[..., None, None] * way[..., :, None] * way[..., None, :]
        sliding = sliding + (friction * stiff)[..., None, None] * way[..., :, None] * normal[..., None, :]
        tangent -= np.where(((part < 1) & held)[..., None, None], sliding, 0.0)
        return _Touch(on, rub - pressure[..., None] * normal, offset - rub / stick,
                      np.where(on[..., None, None], tangent, 0.0), np.where(on[..., None, None], stuck, 0.0))


def _cross_matrix(a: np.ndarray) -> np.ndarray:
    """(..., 3, 3) matrix of the product a x."""
    matrix = np.zeros(a.shape + (3,))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[..., i, j], matrix[..., j, i] = -a[..., k], a[..., k]
    return matrix


def _membrane_tangent(along: np.ndarray, across: np.ndarray, normal: np.ndarray, squeeze: np.ndarray) -> np.ndarray:
    """(n, P, 6, 6): second derivative of (|a|^2 + |b|^2 + squeeze / |a x b|^2) / 2 by the edges a and b."""
    square = np.sum(normal**2, axis=-1)
    first, second = (squeeze / square**2)[..., None, None], (4 * squeeze / square**3)[..., None, None]
    a, b, n = _cross_matrix(along), _cross_matrix(across), _cross_matrix(normal)
    by_edges = np.concatenate([np.cross(across, normal), np.cross(normal, along)], axis=-1)
    tangent = second * by_edges[..., :, None] * by_edges[..., None, :] + np.eye(6)
    tangent[..., :3, :3] += first * (b @ b)
    tangent[..., 3:, 3:] += first * (a @ a)
    tangent[..., :3, 3:] += first * (n - b @ a)
    tangent[..., 3:, :3] -= first * (n + a @ b)
    return tangent


COUNT = 12      # points of an outline. Chosen: of 24, a centroid differs by less than a micrometre
#: Distance of the points over a disc's radius for which the polygon has the disc's second moment over its area; derived.
STRETCH = float(np.sqrt(3 / (2 + np.cos(2 * np.pi / COUNT))))
LEAST = 0.02    # of the mean: least area of a part of an outline. Chosen: a part that is seen from behind must not weigh negatively


def outlines(points: np.ndarray, marker: float, cap: Cap) -> np.ndarray:
    """(K, COUNT + 1, 3) m: points (K, 3), m, on a cap, and the outlines of discs of radius marker, m, around them, along the skin: polygons
    with the second moments of the discs."""
    centre = np.array([0.0, 0.0, cap.centre_z])
    up = (points - centre) / cap.curvature_radius
    along = np.stack([up[:, 2], np.zeros(len(up)), -up[:, 0]], axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = np.cross(up, along)
    turn, angle = np.arange(COUNT) * 2 * np.pi / COUNT, STRETCH * marker / cap.curvature_radius
    way = np.cos(turn)[:, None] * along[:, None] + np.sin(turn)[:, None] * across[:, None]
    round_it = centre + cap.curvature_radius * (np.cos(angle) * up[:, None] + np.sin(angle) * way)
    return np.concatenate([points[:, None], round_it], axis=1)


def appear_at(outline: np.ndarray, camera_centres: np.ndarray) -> np.ndarray:
    """(..., 2): tangents of the directions in which outlines (..., COUNT + 1, 3) appear from camera_centres (..., 3): their centroids."""
    offset = outline - camera_centres[..., None, :]
    seen = offset[..., :2] / offset[..., 2:]
    middle, first = seen[..., :1, :], seen[..., 1:, :]
    second = np.roll(first, -1, axis=-2)
    a, b = first - middle, second - middle
    area = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    area = area * np.sign(area.sum(axis=-1, keepdims=True))
    area = np.maximum(area, LEAST * np.abs(area).mean(axis=-1, keepdims=True) + 1e-30)
    return np.sum(area[..., None] * (middle + first + second), axis=-2) / (3 * area.sum(axis=-1)[..., None])


def centres_of(rest: np.ndarray, camera_centres: np.ndarray, marker: float, sensor: MarkerSensor) -> np.ndarray:
    """(K, 3) m: centres of the untouched markers of radius marker, m, that appear at rest (K, 2), m, in the viewing plane from
    camera_centres (K, 3), m; NaN where unknown."""
    points = rest_points(rest, camera_centres, sensor)
    for _ in range(2):  # each step leaves a twentieth
        appear = appear_at(outlines(points, marker, dome_cap(sensor)),
                           camera_centres) * (sensor.plane_z - camera_centres[:, 2:]) + camera_centres[:, :2]
        off = points[:, :2] - camera_centres[:, :2]
        centre = off / (points[:, 2:] - camera_centres[:, 2:]) * (sensor.plane_z - camera_centres[:, 2:]) + camera_centres[:, :2]
        points = rest_points(rest + centre - appear, camera_centres, sensor)
    return points


def seen_at(places: np.ndarray, camera_centres: np.ndarray, plane_z: float) -> np.ndarray:
    """(K, 2) m: apparent places, in the viewing plane, of places (K, 3), m, seen from camera_centres (K, 3), m."""
    offset = places - camera_centres
    return camera_centres[:, :2] + offset[:, :2] * ((plane_z - camera_centres[:, 2]) / offset[:, 2])[:, None]

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Equilibrium of an inflated dome under a round tip, on a polar mesh that is centred where the tip touches."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.geometry import Cap
from ...common.marker_sensor import MarkerSensor, dome_cap, rest_points
from ...core.errors import BadArgument
from ..constants import DOME
from ..simulated import GAUSS


@dataclass(frozen=True)
class MeshPlan:
    """Plan of a mesh.

    even: rings of equal width at the contact; rings: total number; width: of the even ones, in the unit disc; harmonics: highest; around:
    integration points along half a circle. Under a press of 34 mm on a dome of 120 mm, markers are within 0.03 mm (40 mm from the axis) and
    0.04 mm (70 mm from it) of those of a mesh with rings of half the width and seven harmonics; with 28 rings and four harmonics 0.05 and
    0.12 mm. Distant rings matter, because the gas makes all of the skin bulge.
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
        """Radii (rings + 1,) of the rings in the unit disc, from 0 to 1: even, then growing by a constant factor."""
        outer, count = 1 - self.even * self.width, self.rings - self.even
        low, high = 1.0, 3.0
        for _ in range(60):
            factor = (low + high) / 2
            low, high = (factor, high) if self.width * np.sum(factor**np.arange(1, count + 1)) < outer else (low, factor)
        widths = np.concatenate([np.full(self.even, self.width), self.width * low**np.arange(1, count + 1)])
        return np.concatenate([[0.0], np.cumsum(widths)]) / widths.sum()


def disc_scale(cap: Cap) -> float:
    """Radius of the stereographic projection of a cap's rim: the tangent of half the rim's angle from the pole."""
    return float(np.tan(np.arctan2(cap.rim_radius, -cap.centre_z) / 2))


def disc_of(points: np.ndarray, cap: Cap) -> np.ndarray:
    """Positions (K,), complex, in the unit disc of points (K, 3), m, on the cap."""
    return (points[:, 0] + 1j * points[:, 1]) / ((cap.curvature_radius + points[:, 2] - cap.centre_z) * disc_scale(cap))


def shift_of(across: float, tip_radius: float, cap: Cap) -> float:
    """Shift a of the automorphism for a tip of tip_radius, m, whose centre is across, m, from the dome's axis at first contact."""
    angle = np.arcsin(min(across / (cap.curvature_radius + tip_radius), 0.99))
    return float(np.tan(angle / 2) / disc_scale(cap))


class DomeMesh:
    """The mesh of a contact with the automorphism's shift on a cap.

    At P points in each of n ring elements: rest (n, P, 3), m, and its derivatives along the radius and along the circle, scale (n, P), m:
    length per length in the disc, weight (n, P): area in the disc. Coefficients of a field are (rings + 1, 3, harmonics + 1); even
    fields are mirror symmetric to the meridian plane (x: cosines, y: sines, z: cosines), odd ones antisymmetric.
    """

    def __init__(self, shift: float, cap: Cap, plan: MeshPlan):
        self.shift, self.cap, self.plan, self.n = shift, cap, plan, plan.rings
        edges, phi = plan.edges, (np.arange(plan.around) + 0.5) * np.pi / plan.around
        width, part = np.diff(edges)[:, None], (1 + GAUSS) / 2
        radius = edges[:-1, None] + width * part
        near = np.broadcast_to(np.stack([1 - part, part], axis=-1), (self.n, 2, 2))
        # Shares (3, n, 2, 2) of the rings of an element in a value and in the derivatives along the radius and along the circle.
        self._radial = np.stack([near, np.broadcast_to([-1.0, 1.0], near.shape) / width[..., None], near / radius[..., None]])
        # Of the products of two shares (n, 16, 18): those of plain waves, of values and derivatives along the radius, and of turned ones.
        kind = np.array([[1, 1, 0], [0, 0, 1]])
        self._pairs = np.einsum('ai,bj,ingr,jngs->nabrsijg', kind, kind, self._radial, self._radial).reshape(self.n, 16, 18)
        self.free = [self._free(odd) for odd in (False, True)]  # (size,) bool, of even and of odd fields
        self._waves = [self._around(phi, odd) for odd in (False, True)]
        self._bands = [self._band(waves, free) for waves, free in zip(self._waves, self.free)]
        self.weight = np.repeat(width / 2 * radius * np.pi / plan.around, plan.around, axis=1)
        z = (radius[..., None] * np.exp(1j * phi)).reshape(self.n, -1)
        step = DOME.mesh_difference * z / np.abs(z)
        self.rest = self.points(z)
        self.along, self.across = ((self.points(z + by) - self.points(z - by)) / (2 * DOME.mesh_difference) for by in (step, 1j * step))
        self.scale = np.linalg.norm(self.along, axis=-1)  # the map is conformal

    def _around(self, phi: np.ndarray, odd: bool) -> np.ndarray:
        """(3, 3, around, harmonics + 1): waves of the components of a value and of its derivatives along the radius and the circle."""
        order = np.arange(self.plan.harmonics + 1)
        cos, sin = (function(np.outer(phi, order)) for function in (np.cos, np.sin))
        sines = [(axis == 1) != odd for axis in range(3)]
        plain, turned = [sin if one else cos for one in sines], [order * cos if one else -order * sin for one in sines]
        return np.stack([plain, plain, turned])

    def points(self, z: np.ndarray) -> np.ndarray:
        """Positions (..., 3), m, on the cap of points z (...) of the disc, complex, by the inverse stereographic projection."""
        moved = disc_scale(self.cap) * (z + self.shift) / (1 + self.shift * z)
        far = 2 / (1 + np.abs(moved)**2)
        unit = np.stack([far * moved.real, far * moved.imag, far - 1], axis=-1)
        return unit * self.cap.curvature_radius + [0.0, 0.0, self.cap.centre_z]

    def at_points(self, field: np.ndarray, odd: bool = False) -> np.ndarray:
        """(3, n, P, 3): a field (size,) and its derivatives along the radius and along the circle."""
        rings = field.reshape(self.n + 1, -1)
        near = self._radial @ np.stack([rings[:-1], rings[1:]], axis=1)
        near = near.reshape(3, 2 * self.n, 3, -1).transpose(0, 2, 1, 3) @ self._waves[odd].swapaxes(2, 3)
        return near.reshape(3, 3, self.n, -1).transpose(0, 2, 3, 1)

    def gathered(self, loads: np.ndarray, odd: bool = False) -> np.ndarray:
        """Sums (size,) over the points of loads (1, n, P, 3) on the value, or (3, n, P, 3) also on the derivatives."""
        kinds = len(loads)
        by_wave = loads.transpose(0, 3, 1, 2).reshape(kinds, 3, 2 * self.n, -1) @ self._waves[odd][:kinds]
        near = np.einsum('kngr,kcngm->nrcm', self._radial[:kinds], by_wave.reshape(kinds, 3, self.n, 2, -1))
        rings = np.zeros((self.n + 1, *near.shape[2:]))
        rings[:-1] += near[:, 0]
        rings[1:] += near[:, 1]
        return np.where(self.free[odd], rings.ravel(), 0.0)

    def solve(self, tangent: np.ndarray, right: np.ndarray, odd: bool = False) -> np.ndarray:
        """(size, m): solutions for right (size, m) by the tangent (n, P, 9, 9) of components of value and derivatives."""
        from scipy.linalg import solve_banded  # calibration alone needs it
        (pairs, at, kept), free, wide = self._bands[odd], self.free[odd], 2 * self.plan.size // (self.n + 1) - 1
        shape = self.n, 2, self.plan.around, 3, 3, 3, 3
        by_ring = self._pairs @ tangent.reshape(shape).transpose(0, 3, 5, 1, 2, 4, 6).reshape(self.n, 18, -1)
        by_ring = by_ring.reshape(self.n, 4, 4, self.plan.around, 9).transpose(4, 0, 2, 1, 3).reshape(9, 4 * self.n, -1)
        band = np.bincount(at, (by_ring @ pairs).ravel()[kept], (2 * wide + 1) * len(free)).reshape(2 * wide + 1, -1)
        band[wide, ~free] = 1.0
        return solve_banded((wide, wide), band, np.where(free[:, None], right, 0.0), check_finite=False)

    def _band(self, waves: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Structure of the tangent's band, which rings and their neighbours form.

        Returns products of waves (9, 4 around, orders^2) of pairs of components, and the indices in the band and the numbers of the entries
        that are not constrained.
        """
        orders, kinds = waves.shape[3], waves[[0, 2]]
        pairs = np.einsum('acpm,bdpk->cdabpmk', kinds, kinds).reshape(9, -1, orders**2)
        of, wide = np.arange(6 * orders).reshape(2, 3, -1) + 3 * orders * np.arange(self.n)[:, None, None, None], 6 * orders - 1
        of = of.transpose(2, 0, 1, 3)  # (components, n, rings, orders)
        row, column = np.broadcast_arrays(of[:, None, :, :, None, :, None], of[None, :, :, None, :, None, :])
        kept = np.flatnonzero(free[row] & free[column])
        return pairs, ((wide + row - column) * len(free) + column).ravel()[kept], kept

    def _free(self, odd: bool) -> np.ndarray:
        """Mask (size,) of the free coefficients: none at the rim, only the zeroth harmonic in the centre, no sine of zero."""
        free = np.ones((self.n + 1, 3, self.plan.harmonics + 1), bool)
        free[-1] = free[0, :, 1:] = False
        free[:, [0, 2] if odd else [1], 0] = False
        return free.ravel()


class OnMesh:
    """Locates points (K, 3), m, of the cap on a mesh."""

    def __init__(self, mesh: DomeMesh, points: np.ndarray):
        w = disc_of(points, mesh.cap)
        z = (w - mesh.shift) / (1 - mesh.shift * w)
        edges, radius, phase = mesh.plan.edges, np.abs(z), np.outer(np.angle(z), np.arange(mesh.plan.harmonics + 1))
        self._low = np.clip(np.searchsorted(edges, radius) - 1, 0, mesh.n - 1)
        self._part = ((radius - edges[self._low]) / (edges[self._low + 1] - edges[self._low]))[:, None, None]
        self._waves, self._inside, self._shape = (np.cos(phase), np.sin(phase)), radius[:, None] <= 1, (mesh.n + 1, 3, -1)

    def displaced(self, field: np.ndarray, odd: bool = False) -> np.ndarray:
        """Displacements (K, 3), m, of the points by a field (size,)."""
        rings = field.reshape(self._shape)
        here = rings[self._low] * (1 - self._part) + rings[self._low + 1] * self._part
        moved = [np.einsum('km,km->k', here[:, axis], self._waves[(axis == 1) != odd]) for axis in range(3)]
        return np.where(self._inside, np.stack(moved, axis=1), 0.0)


@dataclass(frozen=True)
class DomeMaterial:
    """Material of a dome.

    squeeze: prestretch^-6, by which a stretched skin is weaker than a soap film of the same tension; gas: relative increase of the pressure
    over relative loss of volume, 0 for a constant pressure; friction: coefficient between tip and skin. Raises BadArgument for numbers out
    of range.
    """

    squeeze: float = 0.5
    gas: float = 50.0
    friction: float = 0.5

    def __post_init__(self):
        if not (0 <= self.squeeze < 1 and 0 <= self.gas < 1e4 and 0 <= self.friction < 10):
            raise BadArgument(f'dome material: need 0 <= squeeze < 1, 0 <= gas < 1e4 and 0 <= friction < 10, got {self}')


@dataclass
class _Touch:
    """Contact at the points.

    on: (n, P), which points are in contact; force, stick_position: (n, P, 3), force and position of sticking; tangent: (n, P, 3, 3), for
    Newton's method; rubbed, stuck: the tangents if all points slide or stick.
    """

    on: np.ndarray
    force: np.ndarray
    stick_position: np.ndarray
    tangent: np.ndarray
    rubbed: np.ndarray
    stuck: np.ndarray


@dataclass(frozen=True)
class PressedDome:
    """Fields of one tip at D depths; NaN from the first depth without convergence, and where not requested.

    straight: (D, size), displacement; along, across: (D, size), even and odd, by a tip that moves the skin laterally by its depth, along
    the meridian and across it; push, push_along, push_across: (D, 3), the corresponding forces of the tip, over G.
    """

    straight: np.ndarray
    along: np.ndarray
    across: np.ndarray
    push: np.ndarray
    push_along: np.ndarray
    push_across: np.ndarray


def press_dome(mesh: DomeMesh, depths: np.ndarray, radius: float, material: DomeMaterial, drags: int = 1) -> PressedDome:
    """Press a tip of radius, m, straight down at the mesh's centre to rising depths (D,), m, along which friction acts.

    drags: every how many depths the fields along and across are computed, 0 for never.
    """
    return _Press(mesh, radius, material).path(np.asarray(depths, float), drags)


@dataclass
class _Skin:
    """The skin at the points.

    positions: (n, P, 3), m; edges: (2, n, P, 3), along the radius and along the circle; normal: of the edges; bends, stress: (2, n, P, 3),
    derivatives of half the square of the normal by the edges, and the stress along them; volume: below the skin, m^3.
    """

    positions: np.ndarray
    edges: np.ndarray
    normal: np.ndarray
    bends: np.ndarray
    stress: np.ndarray
    volume: float


class _Press:
    """Simulates one press by load steps."""

    def __init__(self, mesh: DomeMesh, radius: float, material: DomeMaterial):
        self._mesh, self._radius, self._material, self._u = mesh, radius, material, np.zeros(mesh.plan.size)
        self._weight, self._area = mesh.weight[..., None], (mesh.weight * mesh.scale**2)[..., None]
        self._stiff, self._squeeze = DOME.penalty * (1 - material.squeeze), material.squeeze * mesh.scale**6  # per length in the disc
        cap = mesh.cap
        skin, self._pressure = self._skin(), 2 * (1 - material.squeeze) / cap.curvature_radius
        self._volume = skin.volume
        # Of the discretisation: the sphere is the exact equilibrium.
        self._bias = self._pull(skin, np.zeros(skin.positions.shape)) - self._pressure * self._swell(skin)
        at = np.array([0.0, 0.0, cap.centre_z])
        self._first = at + (mesh.points(np.array(0j)) - at) * (1 + radius / cap.curvature_radius)  # of the tip's centre
        self._settled = np.zeros(mesh.weight.shape, bool), np.zeros(mesh.rest.shape), self._first, skin.positions - self._first

    def path(self, depths: np.ndarray, drags: int) -> PressedDome:
        """Simulate the path as press_dome does."""
        found = PressedDome(*(np.full((len(depths), size), np.nan) for size in (*[self._mesh.plan.size] * 3, 3, 3, 3)))
        last, before, at = self._u, 0.0, 0.0
        for k, depth in enumerate(depths):
            start = self._u
            if at > before:
                self._u = start + (start - last) * min((depth - at) / (at - before), 2.0)
            if not self._reach(at, depth, start, DOME.max_halvings):
                break
            last, before, at = start, at, depth
            found.straight[k], found.push[k] = self._u, self._push()
            if drags and (k + 1) % drags == 0:
                found.along[k], found.push_along[k] = self._dragged(0, depth)
                found.across[k], found.push_across[k] = self._dragged(1, depth)
        return found

    def _reach(self, at: float, depth: float, start: np.ndarray, halvings: int) -> bool:
        """Settle at depth, directly or in two half steps from at; False without convergence."""
        if self._settle(depth):
            return True
        self._u = start
        if halvings == 0 or not self._reach(at, (at + depth) / 2, start, halvings - 1):
            return False
        return self._reach((at + depth) / 2, depth, self._u, halvings - 1)

    def _settle(self, depth: float) -> bool:
        """Find the equilibrium at depth by Newton's method; False without convergence."""
        centre = self._first - [0.0, 0.0, depth]
        self._held, self._anchor = self._met(centre)
        for number in range(DOME.max_newton_steps):
            residual, touch = self._balance(centre, number < DOME.exact_steps)
            step = self._with_gas(self._tangent, -residual, self._swelling)
            if not np.isfinite(step).all():
                return False
            largest = np.abs(step).max()
            self._u = self._u + step * min(1.0, DOME.max_step / max(largest, 1e-12))
            if largest < DOME.tolerance:
                self._settled = touch.on, np.where(touch.on[..., None], touch.stick_position, 0.0), centre, self._skin().positions - centre
                self._touching = touch
                return True
        return False

    def _met(self, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which points stick (n, P), and their positions (n, P, 3) from the tip's centre, as the tip moves from where it settled to centre.

        These are the points that stuck before and those that the tip meets on its path through the skin at rest. If a point stuck only from
        the end of its first step, it would slip by a part of that step.
        """
        held, anchor, before, offset = self._settled
        down, up = before[2] - centre[2], -offset[..., 2]
        root = up**2 - np.sum(offset**2, axis=-1) + (self._radius + DOME.transition)**2
        travel = np.clip(up - np.sqrt(np.maximum(root, 0.0)), 0.0, None)
        meets = ~held & (root > 0) & (travel < down)
        return held | meets, np.where(meets[..., None], offset + travel[..., None] * [0.0, 0.0, 1.0], anchor)

    def _balance(self, centre: np.ndarray, exact: bool) -> tuple[np.ndarray, _Touch]:
        """Residual force (size,) and contact.

        Sets the tangent at the points (for DomeMesh.solve), the derivative of half the volume by the coefficients (size,), and that of the
        pressure by the volume. exact: see _touch.
        """
        skin = self._skin()
        share = self._volume / skin.volume
        pressure = self._pressure * (1 + self._material.gas * (share - 1))
        touch, self._swelling = self._touch(skin.positions - centre, exact), self._swell(skin)
        self._softer = -2 * self._pressure * self._material.gas * share / skin.volume
        along, across = skin.edges
        self._tangent = np.zeros((*self._mesh.weight.shape, 9, 9))
        self._tangent[..., :3, :3] = touch.tangent * self._area[..., None]
        self._tangent[..., :3, 3:6] = _cross_matrix(across * (pressure * self._weight))
        self._tangent[..., :3, 6:] = -_cross_matrix(along * (pressure * self._weight))
        self._tangent[..., 3:, 3:] = _membrane_tangent(skin, self._squeeze) * self._weight[..., None]
        return self._pull(skin, touch.force * self._area) - pressure * self._swelling - self._bias, touch

    def _skin(self) -> _Skin:
        """The skin at the current coefficients."""
        mesh = self._mesh
        moved, *edges = mesh.at_points(self._u)
        along, across = edges[0] + mesh.along, edges[1] + mesh.across
        normal, positions = np.cross(along, across), mesh.rest + moved
        bends = np.stack([np.cross(across, normal), np.cross(normal, along)])
        edges = np.stack([along, across])
        stress = edges - self._squeeze[..., None] / np.sum(normal**2, axis=-1, keepdims=True)**2 * bends
        return _Skin(positions, edges, normal, bends, stress, 2 / 3 * np.sum(mesh.weight * np.sum(positions * normal, axis=-1)))

    def _pull(self, skin: _Skin, force: np.ndarray) -> np.ndarray:
        """Force (size,) of the skin, and of the tip at the points (n, P, 3)."""
        return self._mesh.gathered(np.concatenate([force[None], skin.stress * self._weight]))

    def _swell(self, skin: _Skin) -> np.ndarray:
        """Derivative (size,) of half the volume."""
        return self._mesh.gathered((skin.normal * self._weight)[None])

    def _with_gas(self, tangent: np.ndarray, right: np.ndarray, push: np.ndarray, odd: bool = False) -> np.ndarray:
        """Solution (size,) for right (size,).

        The gas couples all points: its tangent is a product of two vectors push (size,) (Sherman and Morrison 1950).
        """
        found = self._mesh.solve(tangent, np.stack([right, push], axis=1), odd)
        return found[:, 0] + found[:, 1] * (self._softer * (push @ found[:, 0]) / (1 - self._softer * (push @ found[:, 1])))

    def _dragged(self, axis: int, travel: float) -> tuple[np.ndarray, np.ndarray]:
        """Displacement (size,) if the tip moves by travel, m, along x or y and the skin with it; and the change (3,) of the tip's force.

        The skin sticks to the tip; without friction, traction in proportion to the pressure moves it, as of a tip in gross slip. The result
        is linear but accurate for a long travel: the skin in contact moves as one, and an ideal balloon responds linearly.
        """
        odd, aside, tangent = axis == 1, np.eye(3)[axis] * travel, self._tangent.copy()
        push = np.zeros_like(self._u) if odd else self._swelling  # by symmetry the gas does not affect the odd field
        rubs = self._material.friction == 0
        held = tangent[..., :3, :3] = (self._touching.rubbed if rubs else self._touching.stuck) * self._area[..., None]

        def answer(load):
            return self._with_gas(tangent, self._mesh.gathered(load[None], odd), push, odd)

        def at_points(field):
            return self._mesh.at_points(field, odd)[0]

        moved, traction = answer(held @ aside), 0.0
        if rubs:
            normal = self._touching.force * self._area  # of the skin on the tip, outward
            size = np.linalg.norm(normal, axis=-1, keepdims=True)
            along = size * aside - normal * (normal @ aside)[..., None] / np.maximum(size, 1e-30)
            more = answer(along)
            weight = size / max(size.sum(), 1e-30)
            missing, response = (np.sum(weight * (part @ aside)[..., None]) for part in (aside - at_points(moved), at_points(more)))
            moved, traction = moved + more * (missing / response), along * (missing / response)
        force = np.sum(np.matmul(held, (aside - at_points(moved))[..., None])[..., 0] + traction, axis=(0, 1))
        return moved, 2 * force * ([0.0, 1.0, 0.0] if odd else [1.0, 0.0, 1.0])

    def _push(self) -> np.ndarray:
        """Force (3,) of the tip on the skin, both halves."""
        return -2 * np.sum(self._touching.force * self._area, axis=(0, 1)) * [1.0, 0.0, 1.0]

    def _touch(self, offset: np.ndarray, exact: bool) -> _Touch:
        """Contact pressure and Coulomb friction (return mapping, elastic stick) at points offset (n, P, 3), m, from the tip's centre.

        exact: whether the tangent of sliding points is exact, else their secant. The rotation of the pressure is omitted from it, because
        on a slope without friction, points of the border would alternate.
        """
        distance = np.linalg.norm(offset, axis=-1)
        normal, deep, friction = offset / distance[..., None], self._radius + DOME.transition - distance, self._material.friction
        on, held = deep > 0, self._held & (deep > 0)
        stiff = self._stiff * np.clip(deep / (2 * DOME.transition), 0, 1)
        pressure = np.where(on, np.where(deep < 2 * DOME.transition, stiff * deep / 2, self._stiff * (deep - DOME.transition)), 0.0)
        slid = np.where(held[..., None], offset - self._anchor, 0.0)
        slid -= np.sum(slid * normal, axis=-1, keepdims=True) * normal
        amount, stick = np.linalg.norm(slid, axis=-1), self._stiff / 2
        sticks = np.where(stick * amount > friction * pressure, friction * pressure / np.maximum(amount, 1e-30), stick)
        rub = sticks[..., None] * slid
        direction, up = slid / np.maximum(amount, 1e-30)[..., None], normal[..., :, None] * normal[..., None, :]
        flat = np.eye(3) - up
        rubbed = np.where(on[..., None, None], stiff[..., None, None] * up - (pressure / distance)[..., None, None] * flat, 0.0)
        tangent = stiff[..., None, None] * up + (sticks * held)[..., None, None] * flat
        if exact:
            sliding = sticks[..., None] * direction + (friction * stiff)[..., None] * normal
            tangent -= np.where(((sticks < stick) & held)[..., None, None], direction[..., :, None] * sliding[..., None, :], 0.0)
        return _Touch(on, rub - pressure[..., None] * normal, offset - rub / stick, tangent, rubbed,
                      rubbed + (stick * on)[..., None, None] * flat)


def _cross_matrix(a: np.ndarray) -> np.ndarray:
    """Matrix (..., 3, 3) of the cross product with a."""
    matrix = np.zeros(a.shape + (3,))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[..., i, j], matrix[..., j, i] = -a[..., k], a[..., k]
    return matrix


def _membrane_tangent(skin: _Skin, squeeze: np.ndarray) -> np.ndarray:
    """(n, P, 6, 6): second derivative of (|a|^2 + |b|^2 + squeeze / |a x b|^2) / 2 by the edges a and b."""
    square = np.sum(skin.normal**2, axis=-1)
    first, second = (squeeze / square**2)[..., None, None], (4 * squeeze / square**3)[..., None, None]
    (a, b), n, by_edges = skin.edges, _cross_matrix(skin.normal), np.concatenate([*skin.bends], axis=-1)

    def crossed(left, right):
        """The matrix of left x (right x v)."""
        return right[..., :, None] * left[..., None, :] - np.sum(left * right, axis=-1)[..., None, None] * np.eye(3)

    tangent, mixed = second * by_edges[..., :, None] * by_edges[..., None, :] + np.eye(6), n - crossed(b, a)
    tangent[..., :3, :3] += first * crossed(b, b)
    tangent[..., 3:, 3:] += first * crossed(a, a)
    tangent[..., :3, 3:] += first * mixed
    tangent[..., 3:, :3] += first * mixed.swapaxes(-1, -2)
    return tangent


def outlines(points: np.ndarray, marker: float, cap: Cap) -> np.ndarray:
    """Points (K, 3), m, on a cap with the outlines of discs of radius marker, m, around them on the skin: (K, C + 1, 3), m.

    The outlines are polygons with the second moments of the discs.
    """
    centre = np.array([0.0, 0.0, cap.centre_z])
    up = (points - centre) / cap.curvature_radius
    along = np.stack([up[:, 2], np.zeros(len(up)), -up[:, 0]], axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = np.cross(up, along)
    count, angle = DOME.outline_points, DOME.outline_stretch * marker / cap.curvature_radius
    turn = np.arange(count) * 2 * np.pi / count
    direction = np.cos(turn)[:, None] * along[:, None] + np.sin(turn)[:, None] * across[:, None]
    corners = centre + cap.curvature_radius * (np.cos(angle) * up[:, None] + np.sin(angle) * direction)
    return np.concatenate([points[:, None], corners], axis=1)


def appear_at(outline: np.ndarray, camera_centres: np.ndarray) -> np.ndarray:
    """Tangents (..., 2) of the directions of the centroids of outlines (..., C + 1, 3), as observed from camera_centres (..., 3)."""
    offset = outline - camera_centres[..., None, :]
    seen = offset[..., :2] / offset[..., 2:]
    middle, first = seen[..., :1, :], seen[..., 1:, :]
    second = np.roll(first, -1, axis=-2)
    a, b = first - middle, second - middle
    area = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    area = area * np.sign(area.sum(axis=-1, keepdims=True))
    area = np.maximum(area, DOME.min_outline_area * np.abs(area).mean(axis=-1, keepdims=True) + 1e-30)
    return np.sum(area[..., None] * (middle + first + second), axis=-2) / (3 * area.sum(axis=-1)[..., None])


def centres_of(rest: np.ndarray, camera_centres: np.ndarray, marker: float, sensor: MarkerSensor) -> np.ndarray:
    """Centres (K, 3), m, of untouched markers that appear at rest (K, 2), m, in the viewing plane; NaN if unknown.

    camera_centres: (K, 3) m; marker: m, radius of the markers.
    """
    points = rest_points(rest, camera_centres, sensor)
    for _ in range(2):  # each step reduces the error to a twentieth
        appear = appear_at(outlines(points, marker, dome_cap(sensor)),
                           camera_centres) * (sensor.plane_z - camera_centres[:, 2:]) + camera_centres[:, :2]
        offset = points[:, :2] - camera_centres[:, :2]
        centre = offset / (points[:, 2:] - camera_centres[:, 2:]) * (sensor.plane_z - camera_centres[:, 2:]) + camera_centres[:, :2]
        points = rest_points(rest + centre - appear, camera_centres, sensor)
    return points


def seen_at(positions: np.ndarray, camera_centres: np.ndarray, plane_z: float) -> np.ndarray:
    """Apparent positions (K, 2), m, in the viewing plane, of positions (K, 3), m, observed from camera_centres (K, 3), m."""
    offset = positions - camera_centres
    return camera_centres[:, :2] + offset[:, :2] * ((plane_z - camera_centres[:, 2]) / offset[:, 2])[:, None]

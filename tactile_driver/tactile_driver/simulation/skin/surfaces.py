# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated skins: a square grid of nodes with a clamped border, as a dome over a fluid or as a flat sheet."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu

from ..constants import SIMULATION


def by_component(vectors: np.ndarray) -> np.ndarray:
    """The vectors (..., 3) with each component in one piece of memory: long sums and products take half the time."""
    return np.moveaxis(np.ascontiguousarray(np.moveaxis(vectors, -1, 0)), 0, -1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (..., 3); several times faster than NumPy's for the few thousand vectors of a skin."""
    out = np.empty_like(a, shape=np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[..., j], b[..., k], out=out[..., i])
        out[..., i] -= a[..., k] * b[..., j]
    return out


class Skin:
    """A skin of n x n nodes with a clamped border.

    Attributes: nodes: n; rest: (n, n, 3) m; inner: (n*n,) bool, the free nodes; spacing: m, mean distance of nodes; tension: N/m;
    stiffness: N/m, of the skin against a small tool, to an order of magnitude; pressure: Pa, gauge pressure of the enclosed fluid at rest;
    slack: (m, 3) m, force-free positions of the inner nodes, near rest.
    Subclasses also have surface and square_of (from material coordinates (..., 2) in [-1, 1]^2 to the rest shape and back), seen_at_rest
    (ray intersection), rim (border line), touching_height (of a tool), and give, compliance_among and fluid (response to forces).
    longest_step, longest_slide: node spacings that a tool may move, and move along the skin, in one step of contact; settled,
    linearisations: such a step ends when a linearisation moves no node further, in node spacings, or after so many.
    """

    longest_step, longest_slide, settled, linearisations = 0.95, np.inf, 0.005, 6

    def __init__(self, rest: np.ndarray, tension: float):
        self.rest, self.tension, self.stiffness, self.nodes = rest, tension, tension, len(rest)
        border = np.zeros(rest.shape[:2], bool)
        border[[0, -1]] = border[:, [0, -1]] = True
        self.inner = ~border.ravel()
        self.spacing = float(np.sqrt(np.linalg.norm(self.area_vectors(rest), axis=1).sum()) / (self.nodes - 1))

    def area_vectors(self, xyz: np.ndarray) -> np.ndarray:
        """Outward area vectors (n*n, 3), m^2, of the nodes of the shape xyz (n, n, 3), m."""
        cells = cross(xyz[1:, 1:] - xyz[:-1, :-1], xyz[1:, :-1] - xyz[:-1, 1:]) * xyz.dtype.type(0.125)
        out = np.zeros_like(xyz)
        out[:-1, :-1] += cells
        out[1:, :-1] += cells
        out[:-1, 1:] += cells
        out[1:, 1:] += cells
        return out.reshape(-1, 3)

    def volume_of(self, xyz: np.ndarray) -> float:
        """Volume, m^3, between the rim plane and the shape xyz (n, n, 3), m."""
        cells = cross(xyz[1:, 1:] - xyz[:-1, :-1], xyz[1:, :-1] - xyz[:-1, 1:])
        height = xyz[:-1, :-1, 2] + xyz[1:, 1:, 2] + xyz[1:, :-1, 2] + xyz[:-1, 1:, 2]
        return float((cells[..., 2] * height).sum() / 8)

    def slack_at(self, shape: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """Positions (k, 3), m, of the inner nodes near (k,) without contact, linearised at the shape (n, n, 3), m; and the forces (m, 3),
        N, or 0 for none, that move them there from slack."""
        return self.slack[near], 0.0

    def coarse(self, shape: np.ndarray) -> np.ndarray:
        """The shape (n, n, 3), m, subsampled for rendering, float32; light varies slowly, so this suffices."""
        every = max((self.nodes - 1) // SIMULATION.drawn_cells, 1)
        return shape[::every, ::every].astype(np.float32)

    def with_rim(self, positions: np.ndarray) -> np.ndarray:
        """Shape (n, n, 3), m, from the positions (m, 3), m, of the inner nodes."""
        out = self.rest.copy()
        out[1:-1, 1:-1] = positions.reshape(self.nodes - 2, self.nodes - 2, 3)
        return out


# A neo-Hookean membrane stretched to a multiple of its natural size has the energy T/2 |F|^2 per area, which is quadratic in the node
# positions. Its forces are K x, as of springs of length zero, with one constant matrix K for x, y and z, so a frame is cheap to compute. At
# rest the tension T is isotropic, so a sphere of radius R has the pressure 2 T / R (Laplace).


def disc_from_square(square: np.ndarray) -> np.ndarray:
    """Map points (..., 2) of the square [-1, 1]^2 to the unit disc (..., 2), the border to the circle (elliptical grid mapping)."""
    a, b = square[..., 0], square[..., 1]
    return np.stack([a * np.sqrt(1 - b * b / 2), b * np.sqrt(1 - a * a / 2)], axis=-1)


def square_from_disc(disc: np.ndarray) -> np.ndarray:
    """The inverse of disc_from_square."""
    x, y = disc[..., 0], disc[..., 1]
    difference, root = x * x - y * y, 2 * np.sqrt(2)

    def half(sign, value):
        more, less = (np.sqrt(np.maximum(2 + sign * difference + side * root * value, 0)) for side in (1, -1))
        return 0.5 * (more - less)

    return np.stack([half(1, x), half(-1, y)], axis=-1)


class Membrane(Skin):
    """A domed skin of n x n nodes whose border is clamped to the rim circle.

    radius: of curvature at rest, m; height: of the cap above the rim plane, m (defaults: touchpad_contact_region, section 2); tension: N/m,
    nodes: n along each side; shrink: m^3/Pa, decrease of the fluid's volume with its pressure, 0 for water.
    Attributes: volume: m^3, at rest; springs: sparse (m, n*n) N/m, from the positions of all nodes to the
    spring forces on the inner nodes; give: from forces (m, 3), N, on these to their displacements (m, 3), m.
    """

    def __init__(self, radius: float = 0.020, height: float = 0.013, tension: float = 32.0, nodes: int = 49, shrink: float = 0.0):
        self.radius, self.height, self.shrink = radius, height, shrink
        self.centre = np.array([0.0, 0.0, height - radius])
        self._rim_angle = np.arccos(1 - height / radius)
        steps = np.linspace(-1, 1, nodes)
        super().__init__(self.surface(np.stack(np.meshgrid(steps, steps), axis=-1)), tension)
        self._set_up_springs()
        self._balance()

    def surface(self, square: np.ndarray) -> np.ndarray:
        """Points (..., 3), m, of the rest shape at material coordinates (..., 2) in [-1, 1]^2."""
        disc = disc_from_square(square)
        distance = np.linalg.norm(disc, axis=-1)
        angle = self._rim_angle * distance
        sideways = self.radius * self._rim_angle * np.sinc(angle / np.pi)
        return np.stack([disc[..., 0] * sideways, disc[..., 1] * sideways, self.centre[2] + self.radius * np.cos(angle)], axis=-1)

    def square_of(self, xyz: np.ndarray) -> np.ndarray:
        """Material coordinates (..., 2) in [-1, 1]^2 of points (..., 3), m, on the rest shape."""
        arm = xyz - self.centre
        sideways = np.linalg.norm(arm[..., :2], axis=-1)
        distance = np.arctan2(sideways, arm[..., 2]) / self._rim_angle
        return square_from_disc(arm[..., :2] * (distance / np.maximum(sideways, 1e-12))[..., None])

    def seen_at_rest(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Intersections (K, 3), m, of unit rays (K, 3) from origin (3,), m, inside the sphere, with the sphere of the resting skin."""
        arm = origin - self.centre
        half = rays @ arm
        return origin + (np.sqrt(np.maximum(half**2 - arm @ arm + self.radius**2, 0)) - half)[:, None] * rays

    def rim(self, count: int) -> np.ndarray:
        """Points (count, 3), m, evenly spaced on the rim circle."""
        angle, radius = np.linspace(0, 2 * np.pi, count, endpoint=False), np.sqrt(self.height * (2 * self.radius - self.height))
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(angle)], axis=1)

    def touching_height(self, distance: Callable, turn: np.ndarray, x: float, y: float) -> float:
        """Height z, m, of the tool's origin above the rim plane at which the tool, rotated by turn (3, 3), just touches the resting dome.

        The dome is part of a sphere; a tool touches it where its distance from the centre equals the radius. distance: signed distance,
        m, of points (k, 3), m, in the tool frame, exact outside the tool.
        """
        def gap(height: float) -> float:
            return float(distance((self.centre - [x, y, height])[None] @ turn)[0]) - self.radius
        low, high = self.centre[2], self.centre[2] + 3 * self.radius
        while high - low > 1e-12:  # m
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) < 0 else (low, middle)
        return (low + high) / 2

    def _set_up_springs(self):
        """Cotangent spring constants of linear triangles on the rest shape, averaged over both diagonals of each cell."""
        index = np.arange(self.nodes**2).reshape(self.nodes, self.nodes)
        a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))])
        corners = self.rest.reshape(-1, 3)[triangles]
        total = sparse.csr_matrix((self.nodes**2, self.nodes**2))
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            # The cotangent at corner k is the spring of the opposite edge; factors 0.5 for the two diagonals and 0.5 from the energy.
            dot = np.einsum('ij,ij->i', corners[:, i] - corners[:, k], corners[:, j] - corners[:, k])
            weight = 0.25 * self.tension * dot / (2 * area)
            rows = np.concatenate([triangles[:, i], triangles[:, j], triangles[:, i], triangles[:, j]])
            columns = np.concatenate([triangles[:, j], triangles[:, i], triangles[:, i], triangles[:, j]])
            total += sparse.coo_matrix((np.concatenate([-weight, -weight, weight, weight]), (rows, columns)), total.shape).tocsr()
        self.springs = total[self.inner]
        free = self.springs[:, self.inner].tocsc()
        self.give = splu(free).solve
        # Single precision suffices, because give computes the final positions; it halves the memory.
        factor, _ = lapack.spotrf(np.asfortranarray(free.toarray().astype(np.float32)), lower=1, overwrite_a=1)
        lower, _ = lapack.spotri(factor, lower=1, overwrite_c=1)
        self._compliance = lower + np.tril(lower, -1).T

    def _balance(self):
        """Compensate the discretisation error on the sphere, so that the rest shape is an exact equilibrium."""
        self.volume = self.volume_of(self.rest)
        self.pressure = 2 * self.tension / self.radius
        pull = self.springs @ self.rest.reshape(-1, 3)
        bias = pull - self.pressure * self.area_vectors(self.rest)[self.inner]
        rim = self.rest.reshape(-1, 3) * ~self.inner[:, None]
        self.slack = self.give(bias - self.springs @ rim)

    def fluid(self, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
        """First-order model of the enclosed fluid around the shape (n, n, 3), m; its volume decreases in proportion to its pressure.

        Returns push: (m, 3) m^2, force on the inner nodes per Pa; lift: (m, 3) m/Pa, their displacement per Pa; rise: m^3/Pa, growth of
        the volume to fill; and the pressure, Pa, without other forces.
        """
        push = self.area_vectors(shape)[self.inner]
        lift = self.give(push)
        rise = float((push * lift).sum()) + self.shrink
        room = self.volume - self.volume_of(shape) + float((push * (shape.reshape(-1, 3)[self.inner] - self.slack)).sum())
        return push, lift, rise, (room + self.shrink * self.pressure) / rise

    def compliance_among(self, near: np.ndarray) -> np.ndarray:
        """Compliance matrix (k, k), m/N, of the inner nodes with the indices near (k,)."""
        return self._compliance[np.ix_(near, near)].astype(float)


# An incompressible neo-Hookean rubber of stiffness T, stretched isotropically by the factor s, has the energy T/2 (|F|^2 + s^-6 / J^2)
# per area, with the further deformation gradient F and area ratio J. Bending adds D/2 |Laplacian|^2, which smooths the deformation. On a
# rectangular grid the quadratic terms are diagonal in products of sines. The term with J, which draws material towards the contact, is
# small and taken from the previous linearisation. A thick sheet, which bends rather than stretches, has a foundation k/2 |displacement|^2
# instead: without it, a press would bend the whole sheet. Its stretch is infinite: no term draws material towards the contact.


@dataclass(frozen=True)
class Rubber:
    """Of a sheet. tension: T, N/m; stretch: s, from 1.2; bending: D, N m; foundation: k, N/m^3, of an elastic layer that holds the whole
    sheet."""

    tension: float
    stretch: float
    bending: float
    foundation: float = 0.0


class Sheet(Skin):
    """width (along x), height (along y): m; nodes: along each side."""

    #: Nodes rub from the step after their first contact on: in slides of 0.95 spacings the friction of a drag falls to a third of Coulomb's
    #: in some frames, in slides of 0.4 it varies by a tenth (measured).
    longest_slide = 0.4

    def __init__(self, width: float, height: float, rubber: Rubber, nodes: int):
        self.width, self.height = width, height
        tension, bending, foundation = rubber.tension, rubber.bending, rubber.foundation
        self._push_apart = tension * rubber.stretch**-6
        steps = np.linspace(-1, 1, nodes)
        self._half = np.array([width / 2, height / 2])
        super().__init__(self.surface(np.stack(np.meshgrid(steps, steps), axis=-1)), tension)
        self.pressure = 0.0
        self.stiffness = tension + np.sqrt(bending * foundation)
        self.slack = self.rest.reshape(-1, 3)[self.inner]
        wave = np.arange(1, nodes - 1)
        # Single precision suffices: the displacements of a press are exact to some nanometres.
        self._sines = (np.sqrt(2 / (nodes - 1)) * np.sin(np.pi * np.outer(wave, wave) / (nodes - 1))).astype(np.float32)
        dx, dy = width / (nodes - 1), height / (nodes - 1)
        curve = 2 - 2 * np.cos(np.pi * wave / (nodes - 1))
        waves = curve[:, None] / dy**2 + curve / dx**2
        self._give = (1 / (dx * dy * (waves * (tension + bending * waves) + foundation))).astype(np.float32)
        self._cell = dx * dy
        self._still = np.zeros_like(self.slack)

    def surface(self, square: np.ndarray) -> np.ndarray:
        """Points (..., 3), m, of the flat sheet at material coordinates (..., 2) in [-1, 1]^2."""
        return np.concatenate([square * self._half, np.zeros(square.shape[:-1] + (1,))], axis=-1)

    def square_of(self, xyz: np.ndarray) -> np.ndarray:
        """Material coordinates (..., 2) in [-1, 1]^2 of points (..., 3), m, on the flat sheet."""
        return xyz[..., :2] / self._half

    def seen_at_rest(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Intersections (K, 3), m, of unit rays (K, 3) from origin (3,), m, behind the sheet, with its plane."""
        return origin - (origin[2] / rays[:, 2])[:, None] * rays

    def rim(self, count: int) -> np.ndarray:
        """About count points (k, 3), m, on the inner edge of the frame."""
        side = np.linspace(-1, 1, count // 4, endpoint=False)
        one = np.ones_like(side)
        return self.surface(np.concatenate([np.stack(xy, axis=1) for xy in ((side, -one), (one, side), (-side, one), (-one, -side))]))

    def touching_height(self, distance: Callable, turn: np.ndarray, x: float, y: float) -> float:
        """Height z, m, of the tool's origin at which the tool, rotated by turn (3, 3), just touches the flat sheet, at any x and y.

        distance: signed distance, m, of points (k, 3), m, in the tool frame, exact outside the tool.
        """
        return SIMULATION.far - float(distance(np.array([[0, 0, -SIMULATION.far]]) @ turn)[0])

    def slack_at(self, shape: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As Skin.slack_at; the forces are those of the energy term with J in the shape (n, n, 3), m."""
        load = self.push_apart(shape)[1:-1, 1:-1].reshape(-1, 3)
        return self.slack[near] + self.give(load, near), load

    def push_apart(self, shape: np.ndarray) -> np.ndarray:
        """Forces (n, n, 3), N, of the energy term with J on all nodes, from the cell areas of the shape (n, n, 3), m."""
        shape = by_component(shape)
        up, down = shape[1:, 1:] - shape[:-1, :-1], shape[1:, :-1] - shape[:-1, 1:]
        area = cross(up, down)
        square = area[..., 0]**2 + area[..., 1]**2 + area[..., 2]**2
        weight = area * (self._cell**3 * self._push_apart * 4 / square**2)[..., None]
        along_up, along_down = cross(down, weight), cross(weight, up)
        force = np.zeros_like(shape)
        force[1:, 1:] += along_up
        force[:-1, :-1] -= along_up
        force[1:, :-1] += along_down
        force[:-1, 1:] -= along_down
        return force

    def give(self, forces: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        """Displacements (m, 3), m, of the inner nodes under forces (m, 3), N; near: (k,), indices of the wanted nodes, else all."""
        sines, count = self._sines, self.nodes - 2
        field = forces.reshape(count, count, 3).transpose(2, 0, 1).astype(np.float32, order='C')
        modes = sines @ field @ sines * self._give
        if near is None:
            return (sines @ modes @ sines).transpose(1, 2, 0).reshape(-1, 3).astype(float)
        row, column = np.divmod(near, count)
        top, left = row.min(), column.min()
        block = sines[top:row.max() + 1] @ modes @ sines[:, left:column.max() + 1]
        return block[:, row - top, column - left].T.astype(float)

    def compliance_among(self, near: np.ndarray) -> np.ndarray:
        """Compliance matrix (k, k), m/N, of the inner nodes with the indices near (k,)."""
        row, column = np.divmod(near, self.nodes - 2)
        modes = (self._sines[row][:, :, None] * self._sines[column][:, None, :] * np.sqrt(self._give)).reshape(len(near), -1)
        modes = modes.astype(np.float32)
        return (modes @ modes.T).astype(float)

    def fluid(self, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
        """As Membrane.fluid, for open air: push and lift are 0 (m, 3), rise is arbitrary (1 m^3/Pa), the pressure is 0 Pa."""
        return self._still, self._still, 1.0, 0.0

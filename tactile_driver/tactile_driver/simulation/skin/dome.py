# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A dome: a strongly stretched rubber membrane over an enclosed volume of water or gas, on a grid of nodes.

A neo-Hookean membrane stretched to a multiple of its natural size has the energy T/2 |F|^2 per area, which is quadratic in the node
positions. Its forces are K x, as of springs of length zero, with one constant matrix K for x, y and z, so a frame is cheap to compute. At
rest the tension T is isotropic, so a sphere of radius R has the pressure 2 T / R (Laplace).
"""
from __future__ import annotations

from typing import Callable

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu

from .grid import Skin


def disc_from_square(square: np.ndarray) -> np.ndarray:
    """Map points (..., 2) of the square [-1, 1]^2 to the unit disc (..., 2), the border to the circle (elliptical grid mapping)."""
    a, b = square[..., 0], square[..., 1]
    return np.stack([a * np.sqrt(1 - b * b / 2), b * np.sqrt(1 - a * a / 2)], axis=-1)


def square_from_disc(disc: np.ndarray) -> np.ndarray:
    """The inverse of disc_from_square."""
    x, y = disc[..., 0], disc[..., 1]
    difference, root = x * x - y * y, 2 * np.sqrt(2)

    def half(sign, value):
        more, less = (np.sqrt(np.maximum(2 + sign * difference + way * root * value, 0)) for way in (1, -1))
        return 0.5 * (more - less)

    return np.stack([half(1, x), half(-1, y)], axis=-1)


class Membrane(Skin):
    """A domed skin of n x n nodes whose border is clamped to the rim circle.

    radius: of curvature at rest, m; height: of the cap above the rim plane, m (defaults: touchpad_contact_region, section 2); tension: N/m,
    default chosen; nodes: n along each side; shrink: m^3/Pa, decrease of the fluid's volume with its pressure, 0 for water.
    Attributes: node_area: (n*n,) m^2, at rest; volume: m^3, at rest; compliance: (m, m) m/N, inverse of the spring matrix of the inner
    nodes; springs: sparse (m, n*n) N/m, from the positions of all nodes to the spring forces on the inner nodes.
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
        low, high = self.centre[2] - self.radius, self.centre[2] + 3 * self.radius
        for _ in range(4):
            heights = np.linspace(low, high, 40)
            from_tool = self.centre - np.stack([np.full(40, x), np.full(40, y), heights], axis=1)
            inside = int(np.flatnonzero(distance(from_tool @ turn) < self.radius)[-1])
            low, high = heights[inside], heights[min(inside + 1, 39)]
        return 0.5 * (low + high)

    def _set_up_springs(self):
        """Cotangent spring constants of linear triangles on the rest shape, averaged over both diagonals of each cell."""
        index = np.arange(self.nodes**2).reshape(self.nodes, self.nodes)
        a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, 1:].ravel(), index[1:, :-1].ravel()
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))])
        corners = self.rest.reshape(-1, 3)[triangles]
        total = sparse.csr_matrix((self.nodes**2, self.nodes**2))
        self.node_area = np.zeros(self.nodes**2)
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            np.add.at(self.node_area, triangles[:, k], area / 6)
            # The cotangent at corner k is the spring of the opposite edge; factors 0.5 for the two diagonals and 0.5 from the energy.
            dot = np.einsum('ij,ij->i', corners[:, i] - corners[:, k], corners[:, j] - corners[:, k])
            weight = 0.25 * self.tension * dot / (2 * area)
            rows = np.concatenate([triangles[:, i], triangles[:, j], triangles[:, i], triangles[:, j]])
            columns = np.concatenate([triangles[:, j], triangles[:, i], triangles[:, i], triangles[:, j]])
            total += sparse.coo_matrix((np.concatenate([-weight, -weight, weight, weight]), (rows, columns)), total.shape).tocsr()
        self.springs = total[self.inner]
        free = self.springs[:, self.inner]
        self._solve = splu(free.tocsc()).solve
        # Single precision suffices, because _solve computes the final positions; it halves the memory.
        factor, _ = lapack.spotrf(np.asfortranarray(free.toarray().astype(np.float32)), lower=1, overwrite_a=1)
        lower, _ = lapack.spotri(factor, lower=1, overwrite_c=1)
        lower += np.tril(lower, -1).T
        self.compliance = lower

    def _balance(self):
        """Compensate the discretisation error on the sphere, so that the rest shape is an exact equilibrium."""
        self.volume = self.volume_of(self.rest)
        self.pressure = 2 * self.tension / self.radius
        pull = self.springs @ self.rest.reshape(-1, 3)
        bias = pull - self.pressure * self.area_vectors(self.rest)[self.inner]
        rim = self.rest.reshape(-1, 3) * ~self.inner[:, None]
        self.slack = self._solve(bias - self.springs @ rim)

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

    def give(self, forces: np.ndarray) -> np.ndarray:
        """Displacements (m, 3), m, of the inner nodes under additional forces (m, 3), N."""
        return self._solve(forces)

    def compliance_among(self, near: np.ndarray) -> np.ndarray:
        """Compliance matrix (k, k), m/N, of the inner nodes with the indices near (k,)."""
        return self.compliance[np.ix_(near, near)].astype(float)

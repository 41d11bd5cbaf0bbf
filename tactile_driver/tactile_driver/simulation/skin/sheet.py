# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A soft rectangular sheet, stretched flat over a frame, with open air behind it.

A neo-Hookean, incompressible rubber of stiffness T, stretched alike in all directions to s times its natural size, has the energy
T/2 (|F|^2 + s^-6 / J^2) per area, F and J its further change of shape and area; the sheet's thickness adds D/2 |Laplacian|^2, which rounds
the bell off. On a rectangular grid the quadratic terms are diagonal in products of sines; what the term with J does, which draws the
material towards where the sheet is pressed, is small and taken from the step before.
"""
from __future__ import annotations

from typing import Callable

import numpy as np

from .grid import Skin, cross

#: m: from so far off, the nearest point of any tool is its lowest.
_FAR = 1000.0


class Sheet(Skin):
    """width (along x), height (along y): m; tension T: N/m; stretch s: from 1.2; bending D: N m; nodes: along each side."""

    def __init__(self, width: float, height: float, tension: float, stretch: float, bending: float, nodes: int):
        self.width, self.height = width, height
        self._push_apart = tension * stretch**-6
        steps = np.linspace(-1, 1, nodes)
        self._half = np.array([width / 2, height / 2])
        super().__init__(self.surface(np.stack(np.meshgrid(steps, steps), axis=-1)), tension)
        self.pressure = 0.0
        self.slack = self.rest.reshape(-1, 3)[self.inner]
        wave = np.arange(1, nodes - 1)
        self._sines = np.sqrt(2 / (nodes - 1)) * np.sin(np.pi * np.outer(wave, wave) / (nodes - 1))
        dx, dy = width / (nodes - 1), height / (nodes - 1)
        curve = 2 - 2 * np.cos(np.pi * wave / (nodes - 1))
        waves = curve[:, None] / dy**2 + curve / dx**2
        self._give = 1 / (dx * dy * waves * (tension + bending * waves))
        self._cell = dx * dy
        self._still = np.zeros_like(self.slack)

    def surface(self, square: np.ndarray) -> np.ndarray:
        """Places (..., 3) on the flat sheet, m, of material places (..., 2) in [-1, 1]^2."""
        return np.concatenate([square * self._half, np.zeros(square.shape[:-1] + (1,))], axis=-1)

    def square_of(self, xyz: np.ndarray) -> np.ndarray:
        """Material places (..., 2) in [-1, 1]^2 of points (..., 3) on the flat sheet."""
        return xyz[..., :2] / self._half

    def seen_at_rest(self, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
        """Places (K, 3), m, where unit rays (K, 3) from origin (3,) behind the sheet meet its plane."""
        return origin - (origin[2] / rays[:, 2])[:, None] * rays

    def rim(self, count: int) -> np.ndarray:
        """The frame's inner edge: about count places (k, 3), m, all round."""
        way = np.linspace(-1, 1, count // 4, endpoint=False)
        one = np.ones_like(way)
        return self.surface(np.concatenate([np.stack(side, axis=1) for side in ((way, -one), (one, way), (-way, one), (-one, -way))]))

    def touching_height(self, distance: Callable, turn: np.ndarray, x: float, y: float) -> float:
        """Height z, m, of the tool's origin at which the tool, turned by turn (3, 3), just touches the flat sheet, at any x and y.

        distance: of places (k, 3) in the tool's frame, m, exact outside the tool.
        """
        return _FAR - float(distance(np.array([[0, 0, -_FAR]]) @ turn)[0])

    def slack_at(self, shape: np.ndarray) -> np.ndarray:
        """As Skin.slack_at, with what the rubber's thinning does in the shape (n, n, 3), m."""
        return self.slack + self.give(self.push_apart(shape)[self.inner])

    def push_apart(self, shape: np.ndarray) -> np.ndarray:
        """Forces (n*n, 3), N, of the energy's term with J on all nodes, from the areas of the cells of the shape (n, n, 3), m."""
        up, down = shape[1:, 1:] - shape[:-1, :-1], shape[1:, :-1] - shape[:-1, 1:]
        area = 0.5 * cross(up, down)
        size = np.sqrt(np.einsum('...i,...i->...', area, area))[..., None]
        weight = 0.5 * self._push_apart * (self._cell / size)**3 * area / size
        along_up, along_down = cross(down, weight), cross(weight, up)
        force = np.zeros_like(shape)
        force[1:, 1:] += along_up
        force[:-1, :-1] -= along_up
        force[1:, :-1] += along_down
        force[:-1, 1:] -= along_down
        return force.reshape(-1, 3)

    def give(self, forces: np.ndarray) -> np.ndarray:
        """Displacements (m, 3), m, of the inner nodes under forces (m, 3), N."""
        sines, count = self._sines, self.nodes - 2
        field = np.ascontiguousarray(forces.reshape(count, count, 3).transpose(2, 0, 1))
        return (sines @ (sines @ field @ sines * self._give) @ sines).transpose(1, 2, 0).reshape(-1, 3)

    def compliance_among(self, near: np.ndarray) -> np.ndarray:
        """(k, k) m/N: how far each of the inner nodes near (k,) gives way to a force on each of them."""
        row, column = np.divmod(near, self.nodes - 2)
        modes = (self._sines[row][:, :, None] * self._sines[column][:, None, :] * np.sqrt(self._give)).reshape(len(near), -1)
        modes = modes.astype(np.float32)
        return (modes @ modes.T).astype(float)

    def fluid(self, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
        """As Membrane.fluid: open air pushes nothing (m, 3), moves nothing (m, 3), 1 m^3/Pa (any) and has no pressure, Pa."""
        return self._still, self._still, 1.0, 0.0

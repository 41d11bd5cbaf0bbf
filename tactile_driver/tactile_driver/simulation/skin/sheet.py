# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A soft rectangular sheet, stretched flat over a frame, with open air behind it.

An incompressible neo-Hookean rubber of stiffness T, stretched isotropically by the factor s, has the energy T/2 (|F|^2 + s^-6 / J^2) per
area, with the further deformation gradient F and area ratio J. Bending adds D/2 |Laplacian|^2, which smooths the deformation. On a
rectangular grid the quadratic terms are diagonal in products of sines. The term with J, which draws material towards the contact, is small
and taken from the previous linearisation.
"""
from __future__ import annotations

from typing import Callable

import numpy as np

from .grid import Skin, by_component, cross

#: m: at this distance the nearest point of any tool is its lowest; chosen.
_FAR = 1000.0


class Sheet(Skin):
    """width (along x), height (along y): m; tension: T, N/m; stretch: s, from 1.2; bending: D, N m; nodes: along each side."""

    #: Nodes rub from the step after their first contact on: in slides of 0.95 spacings the friction of a drag falls to a third of Coulomb's
    #: in some frames, in slides of 0.4 it varies by a tenth (measured).
    longest_slide = 0.4

    def __init__(self, width: float, height: float, tension: float, stretch: float, bending: float, nodes: int):
        self.width, self.height = width, height
        self._push_apart = tension * stretch**-6
        steps = np.linspace(-1, 1, nodes)
        self._half = np.array([width / 2, height / 2])
        super().__init__(self.surface(np.stack(np.meshgrid(steps, steps), axis=-1)), tension)
        self.pressure = 0.0
        self.slack = self.rest.reshape(-1, 3)[self.inner]
        wave = np.arange(1, nodes - 1)
        # Single precision suffices: the displacements of a press are exact to some nanometres.
        self._sines = (np.sqrt(2 / (nodes - 1)) * np.sin(np.pi * np.outer(wave, wave) / (nodes - 1))).astype(np.float32)
        dx, dy = width / (nodes - 1), height / (nodes - 1)
        curve = 2 - 2 * np.cos(np.pi * wave / (nodes - 1))
        waves = curve[:, None] / dy**2 + curve / dx**2
        self._give = (1 / (dx * dy * waves * (tension + bending * waves))).astype(np.float32)
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
        way = np.linspace(-1, 1, count // 4, endpoint=False)
        one = np.ones_like(way)
        return self.surface(np.concatenate([np.stack(side, axis=1) for side in ((way, -one), (one, way), (-way, one), (-one, -way))]))

    def touching_height(self, distance: Callable, turn: np.ndarray, x: float, y: float) -> float:
        """Height z, m, of the tool's origin at which the tool, rotated by turn (3, 3), just touches the flat sheet, at any x and y.

        distance: signed distance, m, of points (k, 3), m, in the tool frame, exact outside the tool.
        """
        return _FAR - float(distance(np.array([[0, 0, -_FAR]]) @ turn)[0])

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

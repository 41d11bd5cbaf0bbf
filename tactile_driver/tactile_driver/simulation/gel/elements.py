# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An elastic layer by finite elements: what a force on a small disc of its surface moves, at the surface and in the depth of the dots."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..constants import SIMULATION

#: Places and weights of Gauss's rule with three points on [-1, 1].
_GAUSS = list(zip(*np.polynomial.legendre.leggauss(3)))


@dataclass(frozen=True)
class Material:
    """thickness, depth: m, of the layer and of the dots under its surface; young: Pa; poisson."""

    thickness: float
    depth: float
    young: float
    poisson: float


class Response:
    """Displacements around a unit force that is spread over a disc of this radius, m, of the surface of the layer.

    The disc is loaded in the middle of a round layer; the elements are rings, with displacements in cosines and sines of the angle.
    """

    def __init__(self, material: Material, radius: float):
        self.radius = radius
        across = _graded(radius / 2, SIMULATION.mesh_radius * material.thickness, material.thickness)
        down = _graded(radius / 2, material.thickness, material.thickness)
        down *= material.thickness / down[-1]
        depth = down[np.abs(down - material.depth).argmin()]
        down = down + (material.depth - depth) * np.minimum(down / max(depth, 1e-12), (down[-1] - down) / (down[-1] - depth))
        mesh = _Mesh(across, material.thickness - down[::-1])
        pressed, pulled = (mesh.solve(material, order) for order in (0, 1))
        rows = {'surface': len(mesh.z) - 1, 'dots': np.abs(mesh.z - material.thickness + material.depth).argmin()}
        self._lines = {name: (mesh.r, pressed[row], pulled[row]) for name, row in rows.items()}

    def matrix(self, points: np.ndarray, positions: np.ndarray, where: str) -> np.ndarray:
        """(N, 3, M, 3): displacement x, y, z, m, of points (N, 2) m under unit forces along x, y and z at positions (M, 2) m; where:
        'surface' or 'dots'."""
        r, pressed, pulled = self._lines[where]
        off = points[:, None] - positions
        distance = np.sqrt((off**2).sum(-1))
        cos, sin = np.where(distance > 1e-9, off.transpose(2, 0, 1) / np.maximum(distance, 1e-9), np.array([1.0, 0.0])[:, None, None])

        def at(values, column):
            return np.interp(distance, r, values[:, column], right=0.0)

        found = np.empty((len(points), 3, len(positions), 3))
        found[:, 0, :, 2], found[:, 1, :, 2], found[:, 2, :, 2] = at(pressed, 0) * cos, at(pressed, 0) * sin, at(pressed, 1)
        for axis, (c, s) in enumerate(((cos, sin), (sin, -cos))):  # of the angle from the force to the point
            radial, around, up = at(pulled, 0) * c, at(pulled, 2) * s, at(pulled, 1) * c
            found[:, 0, :, axis] = radial * cos - around * sin
            found[:, 1, :, axis] = radial * sin + around * cos
            found[:, 2, :, axis] = up
        return found


def _graded(finest: float, length: float, thickness: float) -> np.ndarray:
    """From 0 to length, m, or somewhat more, in steps that grow from finest."""
    positions, step = [0.0], finest
    while positions[-1] < length:
        positions.append(positions[-1] + step)
        step = min(step * (SIMULATION.element_growth if len(positions) > 4 else 1.0), SIMULATION.max_element * thickness)
    return np.array(positions)


def _quadratic(a: float) -> tuple[np.ndarray, np.ndarray]:
    """Values (3,) and slopes (3,) at a of the parabolas that are 1 at -1, 0 or 1 and 0 at the others."""
    return np.array([a * (a - 1) / 2, 1 - a * a, a * (a + 1) / 2]), np.array([a - 0.5, -2 * a, a + 0.5])


class _Mesh:
    """Rings between radii across (A,) and heights up (B,), m, each of nine nodes, with biquadratic displacements. r, z: m, of the columns
    and rows of nodes."""

    def __init__(self, across: np.ndarray, up: np.ndarray):
        self.r, self.z = (np.sort(np.concatenate([line, (line[1:] + line[:-1]) / 2])) for line in (across, up))
        row, column = (2 * n.ravel() for n in np.mgrid[:len(up) - 1, :len(across) - 1])
        three = np.arange(3)
        self._elements = ((row[:, None, None] + three[:, None]) * len(self.r) + column[:, None, None] + three).reshape(-1, 9)
        self._low, self._size = np.stack([self.r[column], self.z[row]]), np.stack([np.diff(across)[column // 2], np.diff(up)[row // 2]]) / 2

    def solve(self, material: Material, order: int) -> np.ndarray:
        """Displacements (rows, columns, 3) radial, up, around (in cosines, cosines, sines of order times the angle) under a unit force on
        the first two rings of the surface: up for order 0, along the angle 0 for order 1."""
        free = np.ones((len(self.z), len(self.r), 3), bool)
        free[0] = free[:, -1] = False
        free[:, 0, order] = False  # on the axis nothing moves sideways, or up
        if order == 0:
            free[..., 2] = False
        load = np.zeros(free.shape)
        columns = load[-1, :5]
        for ring in (0, 2):
            half, middle = (self.r[ring + 2] - self.r[ring]) / 2, self.r[ring + 1]
            for a, weight in _GAUSS:
                value = _quadratic(a)[0]
                share = weight * half * (middle + a * half) * value / (np.pi * self.r[4]**2)  # over what the angle's integral has, too
                columns[ring:ring + 3] += share[:, None] * ([0, 1, 0] if order == 0 else [1, 0, -1])
        at, found = np.flatnonzero(free), np.zeros(free.size)
        found[at] = splu(self._stiffness(material, order)[at][:, at].tocsc()).solve(load.ravel()[at])
        return found.reshape(free.shape)

    def _stiffness(self, material: Material, order: int) -> sparse.csr_matrix:
        shear = material.young / (2 * (1 + material.poisson))
        lame = material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
        elastic = np.diag([2 * shear] * 3 + [shear] * 3)
        elastic[:3, :3] += lame
        total = np.zeros((len(self._elements), 27, 27))
        for a, weight_a in _GAUSS:
            for b, weight_b in _GAUSS:
                (along, slope_along), (up, slope_up) = _quadratic(a), _quadratic(b)
                value = np.outer(up, along).ravel()
                dr = np.outer(up, slope_along).ravel() / self._size[0][:, None]
                dz = np.outer(slope_up, along).ravel() / self._size[1][:, None]
                r = self._low[0] + (a + 1) * self._size[0]
                over = value / r[:, None]
                strain = np.zeros((len(r), 6, 9, 3))  # rr, zz, around; rz, r around, z around
                strain[:, 0, :, 0], strain[:, 1, :, 1] = dr, dz
                strain[:, 2, :, 0], strain[:, 2, :, 2] = over, order * over
                strain[:, 3, :, 0], strain[:, 3, :, 1] = dz, dr
                strain[:, 4, :, 0], strain[:, 4, :, 2] = -order * over, dr - over
                strain[:, 5, :, 1], strain[:, 5, :, 2] = -order * over, dz
                strain = strain.reshape(-1, 6, 27)
                weight = weight_a * weight_b * r * self._size.prod(axis=0)
                total += (elastic @ strain * weight[:, None, None]).transpose(0, 2, 1) @ strain
        number = (3 * self._elements[:, :, None] + np.arange(3)).reshape(-1, 27)
        rows, columns = np.repeat(number, 27, axis=1).ravel(), np.tile(number, 27).ravel()
        return sparse.csr_matrix((total.ravel(), (rows, columns)), (3 * len(self.r) * len(self.z),) * 2)

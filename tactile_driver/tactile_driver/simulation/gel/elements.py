# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An elastic layer by finite elements: what a force on a small disc of its surface moves, at the surface and in the depth of the dots."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

#: Thicknesses: radius of the meshed disc, whose border is held; chosen.
_WIDE = 9.0
#: Growth of the elements away from the load, and their largest size in thicknesses; chosen: half of both changes nothing by 0.3 %.
_GROWTH, _LARGEST = 1.14, 0.25
#: Nodes of a serendipity quadrilateral, and the points of its reduced integration, which does not lock where volume is kept.
_NODES = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)], float)
_POINTS = np.array([(a, b) for a in (-1, 1) for b in (-1, 1)]) / np.sqrt(3)


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
        across = _graded(radius / 2, _WIDE * material.thickness, material.thickness)
        down = _graded(radius / 2, material.thickness, material.thickness)
        down *= material.thickness / down[-1]
        depth = down[np.abs(down - material.depth).argmin()]
        down = down + (material.depth - depth) * np.minimum(down / max(depth, 1e-12), (down[-1] - down) / (down[-1] - depth))
        mesh = _Mesh(across, material.thickness - down[::-1])
        pressed, pulled = (mesh.solve(material, order, radius) for order in (0, 1))
        self._lines = {}
        for name, height in (('surface', material.thickness), ('dots', material.thickness - material.depth)):
            line = np.flatnonzero(np.abs(mesh.z - height) < 1e-9)
            line = line[np.argsort(mesh.r[line])]
            self._lines[name] = mesh.r[line], pressed[line], pulled[line]

    def matrix(self, points: np.ndarray, places: np.ndarray, where: str) -> np.ndarray:
        """(N, 3, M, 3): displacement x, y, z, m, of points (N, 2) m under unit forces along x, y and z at places (M, 2) m; where:
        'surface' or 'dots'."""
        r, pressed, pulled = self._lines[where]
        off = points[:, None] - places
        distance = np.sqrt((off**2).sum(-1))
        cos, sin = np.where(distance > 1e-9, off.transpose(2, 0, 1) / np.maximum(distance, 1e-9), np.array([1.0, 0.0])[:, None, None])

        def at(values, column):
            return np.interp(distance, r, values[:, column], right=0.0)

        found = np.empty((len(points), 3, len(places), 3))
        found[:, 0, :, 2], found[:, 1, :, 2], found[:, 2, :, 2] = at(pressed, 0) * cos, at(pressed, 0) * sin, at(pressed, 1)
        for axis, (c, s) in enumerate(((cos, sin), (sin, -cos))):  # of the angle from the force to the point
            radial, around, up = at(pulled, 0) * c, at(pulled, 2) * s, at(pulled, 1) * c
            found[:, 0, :, axis] = radial * cos - around * sin
            found[:, 1, :, axis] = radial * sin + around * cos
            found[:, 2, :, axis] = up
        return found


def _graded(finest: float, length: float, thickness: float) -> np.ndarray:
    """From 0 to length, m, or somewhat more, in steps that grow from finest."""
    places, step = [0.0], finest
    while places[-1] < length:
        places.append(places[-1] + step)
        step = min(step * (_GROWTH if len(places) > 4 else 1.0), _LARGEST * thickness)
    return np.array(places)


class _Mesh:
    """Rings between radii across (A,) and heights up (B,), m. r, z: (N,) m, of the nodes."""

    def __init__(self, across: np.ndarray, up: np.ndarray):
        fine_r, fine_z = (np.sort(np.concatenate([line, (line[1:] + line[:-1]) / 2])) for line in (across, up))
        index = -np.ones((len(fine_z), len(fine_r)), int)
        real = ~((np.arange(len(fine_z))[:, None] % 2 == 1) & (np.arange(len(fine_r)) % 2 == 1))
        index[real] = np.arange(real.sum())
        row, column = np.nonzero(real)
        self.r, self.z = fine_r[column], fine_z[row]
        j, i = (2 * n.ravel() for n in np.mgrid[:len(up) - 1, :len(across) - 1])
        self.elements = np.stack([index[j + 1 + b, i + 1 + a] for a, b in _NODES.astype(int)], axis=1)
        self.across, self.up = across, up

    def solve(self, material: Material, order: int, radius: float) -> np.ndarray:
        """Displacements (N, 3) radial, up, around (in cosines, cosines, sines of order times the angle) under a unit force on the disc:
        up for order 0, along the angle 0 for order 1."""
        stiffness = self._stiffness(material, order)
        load = self._load(order, radius)
        held = (self.z < 1e-9) | (self.r > self.across[-1] - 1e-9)
        fixed = np.repeat(held[:, None], 3, axis=1)
        fixed[:, 2] |= order == 0
        if order == 0:
            fixed[self.r < 1e-9, 0] = True
        else:
            fixed[self.r < 1e-9, 1] = True
        free = np.flatnonzero(~fixed.ravel())
        found = np.zeros(3 * len(self.r))
        found[free] = splu(stiffness[free][:, free].tocsc()).solve(load.ravel()[free])
        return found.reshape(-1, 3)

    def _stiffness(self, material: Material, order: int) -> sparse.csr_matrix:
        shear = material.young / (2 * (1 + material.poisson))
        lame = material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
        elastic = np.diag([2 * shear] * 3 + [shear] * 3)
        elastic[:3, :3] += lame
        corner = np.stack([self.r, self.z], axis=1)[self.elements]
        size = (corner[:, 2] - corner[:, 0]) / 2
        total = np.zeros((len(size), 24, 24))
        for a, b in _POINTS:
            value, slope = _shape(a, b)
            dr, dz = slope[:, 0] / size[:, :1], slope[:, 1] / size[:, 1:]
            r = corner[:, :, 0] @ value
            over = value / r[:, None]
            strain = np.zeros((len(size), 6, 8, 3))  # rr, zz, around; rz, r around, z around
            strain[:, 0, :, 0], strain[:, 1, :, 1] = dr, dz
            strain[:, 2, :, 0], strain[:, 2, :, 2] = over, order * over
            strain[:, 3, :, 0], strain[:, 3, :, 1] = dz, dr
            strain[:, 4, :, 0], strain[:, 4, :, 2] = -order * over, dr - over
            strain[:, 5, :, 1], strain[:, 5, :, 2] = -order * over, dz
            strain = strain.reshape(-1, 6, 24)
            total += np.einsum('eki,kl,elj,e->eij', strain, elastic, strain, r * size.prod(axis=1), optimize=True)
        number = (3 * self.elements[:, :, None] + np.arange(3)).reshape(-1, 24)
        rows, columns = np.repeat(number, 24, axis=1).ravel(), np.tile(number, 24).ravel()
        return sparse.csr_matrix((total.ravel(), (rows, columns)), (3 * len(self.r),) * 2)

    def _load(self, order: int, radius: float) -> np.ndarray:
        """(N, 3) of a unit force, over the factor of the angle's integral that the stiffness leaves out too."""
        load, top = np.zeros((len(self.r), 3)), self.elements[self.z[self.elements[:, 2]] > self.up[-1] - 1e-9]
        # the disc ends on a border of elements: the first two have half its radius
        inside = top[self.r[top[:, 2]] < radius * (1 + 1e-6)]
        loaded = self.r[inside[:, 2]].max()
        for nodes in inside:
            half = (self.r[nodes[2]] - self.r[nodes[3]]) / 2
            for a, weight in zip((-np.sqrt(0.6), 0.0, np.sqrt(0.6)), (5 / 9, 8 / 9, 5 / 9)):
                value = _shape(a, 1.0)[0]
                share = weight * half * (value @ self.r[nodes]) * value / (np.pi * loaded**2)
                if order == 0:
                    load[nodes, 1] += share
                else:
                    load[nodes, 0] += share
                    load[nodes, 2] -= share
        return load


def _shape(a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
    """Values (8,) and slopes (8, 2) of the serendipity functions at (a, b)."""
    value, slope = np.empty(8), np.empty((8, 2))
    for k, (p, q) in enumerate(_NODES):
        if p and q:
            value[k] = (1 + a * p) * (1 + b * q) * (a * p + b * q - 1) / 4
            slope[k] = (p * (1 + b * q) * (2 * a * p + b * q) / 4, q * (1 + a * p) * (a * p + 2 * b * q) / 4)
        elif q:
            value[k], slope[k] = (1 - a * a) * (1 + b * q) / 2, (-a * (1 + b * q), q * (1 - a * a) / 2)
        else:
            value[k], slope[k] = (1 + a * p) * (1 - b * b) / 2, (p * (1 - b * b) / 2, -b * (1 + a * p))
    return value, slope

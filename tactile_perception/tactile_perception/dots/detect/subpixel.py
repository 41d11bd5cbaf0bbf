# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Maximum-likelihood position, size and contrast of dots in small patches, all dots at once.

A dot is a blurred disc (dot_profile.py) of unknown position, diameter, amplitude and background. The model is linearised at a few hundred
nodes of sub-pixel position and diameter. At each node, the weighted least-squares estimate of the differences from the node is a matrix
applied to the patch. The rows of these matrices span few dimensions, so patches are projected onto them once, and every Gauss-Newton step
works on _DIMENSIONS numbers per dot.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .dot_profile import disc_modes

_PER_PIXEL = 3  # nodes per pixel along each axis: the model is linear between them to 0.001 px
_REACH = 3  # nodes on each side of the patch's centre: one pixel
_SIDE = 2 * _REACH + 1
_TAIL = 2.2  # blurs outside the dot's edge where the window ends: 1 % of the information about its position lies beyond
_TAPER = 2.0  # px over which the window falls from one to zero. Chosen
_DIMENSIONS = 32  # dimensions of the compression: it shifts positions by less than 0.001 px
_MODELS_FIRST = 1e3  # weight of the dots' images against the rows in the compression, so that its loss causes no bias. Chosen
_NOTHING = np.float32(1e-12)  # grey levels, prevents division by zero
_MANY_NEW = 0.7  # share of the dots at new nodes above which all are computed at once. Chosen: affects the time alone
_STEPS = np.array([[0.7], [0.7], [1.5]])  # px, longest step in u, v and diameter. Chosen
_STRIDES = np.array([1, _SIDE, _SIDE * _SIDE], np.float32)  # of a node's index by u, v and diameter


@dataclass
class Fit:
    """Fitted dots. values: (5, N), rows u, v, diameter, amplitude, ground; node: (N,), node of the last step.

    u, v (from the patch's centre) and diameter are in px; amplitude (dot minus background) and ground (background) in grey levels.
    """

    values: np.ndarray
    node: np.ndarray

    u = property(lambda self: self.values[0])
    v = property(lambda self: self.values[1])
    diameter = property(lambda self: self.values[2])
    amplitude = property(lambda self: self.values[3])
    ground = property(lambda self: self.values[4])

    def away(self) -> np.ndarray:
        """(N,) px, distances from the patches' centres: the larger of both axes."""
        return np.maximum(np.abs(self.values[0]), np.abs(self.values[1]))

    def take(self, some: np.ndarray) -> Fit:
        """The fits of a subset; some: indices."""
        return Fit(self.values.take(some, axis=1), self.node.take(some))

    def put(self, some: np.ndarray, other: Fit):
        """Overwrite the fits of the dots `some` (indices) with those of other, in place."""
        self.values[:, some] = other.values
        self.node[some] = other.node


class LikelihoodFitter:
    """Fits discs of a range of diameters, imaged with a known blur.

    smallest, largest: diameters, px; blur: standard deviation, px. Construction takes about a tenth of a second.
    """

    def __init__(self, smallest: float, largest: float, blur: float):
        self.blur = blur
        self.diameters = np.linspace(smallest, largest, 2 + int((largest - smallest) / 0.6))
        # within the fit, positions are in units of nodes from the first node
        self._density = np.array([[_PER_PIXEL], [_PER_PIXEL], [1 / (self.diameters[1] - self.diameters[0])]])
        self._first = np.array([[-_REACH / _PER_PIXEL], [-_REACH / _PER_PIXEL], [smallest]])
        self._last = np.array([[_SIDE - 1], [_SIDE - 1], [len(self.diameters) - 1]], np.float32)
        self._longest = (_STEPS * self._density).astype(np.float32)
        self.tail = _TAIL * np.hypot(blur, 0.3)
        self.half = int(np.ceil(largest / 2 + self.tail - 0.3))
        self._build()

    def patches(self, padded: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(N, P) float32, square patches with sides of 2 half + 1 px around pixels (column, row) (N,) of an image padded by half."""
        side, size, width = 2 * self.half + 1, padded.itemsize, padded.shape[1]
        shape = (padded.shape[0] - side + 1, width - side + 1, side)
        rows = np.ndarray(shape, f'V{side * size}', np.ascontiguousarray(padded), 0, (width * size, size, width * size))  # of a square each
        return rows[row, column].view(padded.dtype).reshape(len(row), -1).astype(np.float32)

    def compress(self, patches: np.ndarray, level: float = 0.0) -> np.ndarray:
        """(N, K) projections of patches (N, P) minus a grey level, the input of fit() and variances().

        A level near the background keeps projections small, so that their differences stay accurate in single precision.
        """
        return patches @ self.basis - level * self._even

    def fit(self, compressed: np.ndarray, u: np.ndarray, v: np.ndarray, diameter: np.ndarray, steps: int) -> Fit:
        """Fits after this many Gauss-Newton steps; u, v: initial positions, (N,) px from the patches' centres; diameter: (N,) px."""
        columns, place = compressed[:, :, None], self._in_nodes(np.stack([u, v, diameter]))
        node = answer = None
        for _ in range(steps):
            nearest, start = self._nearest(place)
            if node is None:
                answer = np.matmul(self._rows.take(nearest, axis=0), columns)[:, :, 0].T
            else:
                new = np.flatnonzero(nearest != node)  # at the same node, a step repeats the last one
                if not len(new):
                    break
                if len(new) > _MANY_NEW * len(node):
                    answer = np.matmul(self._rows.take(nearest, axis=0), columns)[:, :, 0].T
                else:
                    answer[:, new] = np.matmul(self._rows.take(nearest[new], axis=0), columns[new])[:, :, 0].T
            node = nearest
            step = answer[:3] / (answer[3] + _NOTHING)
            place = start + np.minimum(np.maximum(step, -self._longest), self._longest)
        values = answer.astype(float)
        values[:3] = place / self._density + self._first
        return Fit(values, node)

    def refine(self, fit: Fit, compressed: np.ndarray, cleaned: np.ndarray):
        """One more step, in place, for the dots it changes: those now at another node, and those whose patch changed, cleaned (N,) bool."""
        moved = np.flatnonzero(cleaned | (self._nearest(self._in_nodes(fit.values[:3]))[0] != fit.node))
        if len(moved):
            fit.put(moved, self.fit(compressed[moved], fit.u[moved], fit.v[moved], fit.diameter[moved], 1))

    def correct_slope(self, fit: Fit, slopes: np.ndarray):
        """Correct the positions, in place, for the bias by sloping illumination, which scales dot and background alike.

        slopes: (2, N), background slopes along u and v as shares of the background per pixel.
        """
        by_ground, by_dot = self._levers.take(fit.node, axis=1)
        fit.values[:2] -= (by_ground * fit.ground / (fit.amplitude + _NOTHING) + by_dot) * slopes

    def gains(self, fit: Fit) -> np.ndarray:
        """(N,) variance of a position along an axis, px^2, per unit of pixel variance (grey levels^2)."""
        return self._gain.take(fit.node) / np.maximum(fit.amplitude**2, 1e-6)

    def variances(self, compressed: np.ndarray, fit: Fit) -> np.ndarray:
        """(N,) residual variance of the pixels, grey levels^2. Residuals by slopes, ellipticity and blur are excluded: they do not shift
        positions."""
        modes = self._modes.take(fit.node, axis=0)
        explained = np.matmul(modes, compressed[:, :, None])[:, :, 0]
        rest = np.einsum('ij,ij->i', compressed, compressed) - np.einsum('ij,ij->i', explained, explained)
        return np.maximum(rest, 0).astype(float) / (compressed.shape[1] - modes.shape[1])

    def _in_nodes(self, place):
        """(3, N) positions in units of nodes; place: (3, N) px."""
        return ((place - self._first) * self._density).astype(np.float32)

    def _nearest(self, place):
        """Index (N,) and coordinates (3, N) of the nodes nearest to positions (3, N), all in units of nodes."""
        whole = np.minimum(np.maximum(np.rint(place), 0), self._last)
        return (_STRIDES @ whole).astype(np.int64), whole

    def _build(self):
        reach = np.arange(-self.half, self.half + 1, dtype=float)
        parts = [self._nodes(reach, diameter) for diameter in self.diameters]
        modes, windows = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
        models = modes[:, :, :5]
        weighted = models * windows[:, :, None]
        rows = np.linalg.solve(weighted.transpose(0, 2, 1) @ models, weighted.transpose(0, 2, 1))
        self._gain = np.einsum('nij,nij->n', rows[:, 1:3], rows[:, 1:3]) / 2
        basis = _compression(rows, models[:, :, 0])
        self.basis = np.ascontiguousarray(basis, np.float32)
        self._even = self.basis.sum(0)
        in_nodes = (rows @ basis)[:, [1, 2, 3, 0, 4]]
        in_nodes[:, :3] *= self._density
        self._rows = np.ascontiguousarray(in_nodes, np.float32)
        self._modes = np.ascontiguousarray(np.linalg.qr(basis.T @ modes)[0].transpose(0, 2, 1), np.float32)
        central = _SIDE * _SIDE * np.arange(len(self.diameters)) + _SIDE * _SIDE // 2
        x = np.tile(reach, len(reach))
        levers = [rows[central, 1] @ x, (rows[central, 1] * models[central, :, 0]) @ x]
        self._levers = np.repeat(levers, _SIDE * _SIDE, axis=1)

    def _nodes(self, reach, diameter):
        """(nodes, P, 10) derivatives of a dot's image by amplitude, u, v, diameter, background, its two slopes, two components of
        ellipticity, and blur; and (nodes, P) windows."""
        phases = np.arange(-_REACH, _REACH + 1) / _PER_PIXEL
        v, u, y, x = np.meshgrid(phases, phases, reach, reach, indexing='ij')
        x, y = (x - u).reshape(_SIDE**2, -1), (y - v).reshape(_SIDE**2, -1)
        m = disc_modes(x, y, diameter, self.blur)
        edge = np.clip((diameter / 2 + self.tail - np.hypot(x, y)) / _TAPER + 0.5, 0, 1)
        stack = np.stack([m.shape, m.by_u, m.by_v, m.by_diameter, np.ones_like(x), x, y, m.oval, m.oval_oblique, m.by_blur], 2)
        return stack, edge * edge * (3 - 2 * edge)


def _compression(rows, images):
    """(P, K) orthonormal basis of the dots' images and, with less weight, of the rows: leading principal directions."""
    flat = rows.reshape(-1, rows.shape[2])
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    images = images / np.linalg.norm(images, axis=1, keepdims=True)
    even = np.full(rows.shape[2], rows.shape[2] ** -0.5)
    spread = flat.T @ flat + _MODELS_FIRST * (images.T @ images + len(images) * np.outer(even, even))
    _, axes = np.linalg.eigh(spread)
    return axes[:, ::-1][:, :_DIMENSIONS]

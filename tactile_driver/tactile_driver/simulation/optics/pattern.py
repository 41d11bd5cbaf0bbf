# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The dots printed on the inside of a skin, and their positions on the deformed skin."""
from __future__ import annotations

from typing import Callable

import numpy as np
from scipy import sparse

from ..skin.surfaces import Skin
from .camera import SimulatedCamera

#: Catmull-Rom weights of four nodes as polynomials of the fraction between the middle two, the highest power first.
_CUBIC = np.array([[-1, 2, -1, 0], [3, -5, 0, 2], [-3, 4, 1, 0], [1, -1, 0, 0]]) / 2


class SurfaceSampler:
    """Positions and tangents of fixed material points on a grid of nodes, by cubic interpolation. square: (K, 2), material coordinates in
    [-1, 1]^2; nodes: n along each side."""

    def __init__(self, square: np.ndarray, nodes: int):
        at = (square + 1) * (nodes - 1) / 2
        low = np.clip(np.floor(at).astype(int), 1, nodes - 3)
        powers = (at - low)[..., None]**np.arange(3, -1, -1)  # (K, 2, 4)
        value, slope = powers @ _CUBIC.T, powers[..., 1:] @ (_CUBIC[:, :3] * [3, 2, 1]).T
        linear = np.maximum(1 - np.abs((at - low)[..., None] - np.arange(-1, 3)), 0)
        reach = np.arange(-1, 3)
        columns = (low[:, 1, None] + reach)[:, :, None] * nodes + (low[:, 0, None] + reach)[:, None, :]

        def matrix(along_b, along_a):
            return sparse.csr_matrix(((along_b[:, 1, :, None] * along_a[:, 0, None, :]).ravel(), columns.ravel(),
                                      np.arange(0, columns.size + 1, 16)), (len(at), nodes * nodes))

        self.linear, self.value = matrix(linear, linear), matrix(value, value)
        self.along_a, self.along_b = matrix(value, slope), matrix(slope, value)

    def positions(self, shape: np.ndarray) -> np.ndarray:
        """Positions (K, 3), m, on the shape (n, n, 3), m."""
        return self.value @ shape.reshape(-1, 3)

    def tangents(self, shape: np.ndarray) -> np.ndarray:
        """Tangents (K, 3, 2), m per grid step, along the two directions of the grid."""
        flat = shape.reshape(-1, 3)
        return np.stack([self.along_a @ flat, self.along_b @ flat], axis=-1)


class DotPattern:
    """Round dots on the inside of a skin.

    positions: (K, 3), m, centres on the resting skin; radius: (K,) m; numbers: (K,) of the dots; rows, columns: of the grid, 0 without one.
    Other attributes: sampler, of the centres; painted: (K, 2, 2), grid steps per m along two perpendicular directions on the resting skin.
    """

    def __init__(self, skin: Skin, positions: np.ndarray, radius: np.ndarray, numbers: np.ndarray, rows: int = 0, columns: int = 0):
        self.radius, self.numbers, self.rows, self.columns = radius, numbers, rows, columns
        self.sampler = SurfaceSampler(skin.square_of(positions), skin.nodes)
        self.painted = np.linalg.inv(np.linalg.qr(self.sampler.tangents(skin.rest))[1])

    def seen(self, shape: np.ndarray, camera: SimulatedCamera, correct: Callable | None = None) -> tuple:
        """Positions (K, 3), m, pixels (K, 2), and the affine maps (K, 2, 2), px/m, from each printed disc to the image.

        correct: function (K, 3) -> (K, 3), applied to the positions before projection.
        """
        positions = self.sampler.positions(shape)
        if correct is not None:
            positions = correct(positions)
        uv, slope = camera.project_with_slope(positions)
        return positions, uv, slope @ self.sampler.tangents(shape) @ self.painted


class LargeDots(DotPattern):
    """Dots so large that they are seen bent: where the image shows the centroid of their area, which lies nearer to the part that faces the
    camera than the centre does, and as large as it shows them. By points inside: the estimator of domes goes by outlines, that of sheets by
    fewer points, and no formula is shared."""

    #: Points of the unit disc and their shares, exact to the fifth degree: Stroud, Approximate Calculation of Multiple Integrals, 1971.
    _AT = np.concatenate([[0.0], np.sqrt(2 / 3) * np.exp(1j * np.pi / 3 * np.arange(6))])
    _SHARE = np.array([2, 1, 1, 1, 1, 1, 1]) / 8

    def __init__(self, skin: Skin, positions: np.ndarray, radius: np.ndarray, numbers: np.ndarray, rows: int = 0, columns: int = 0):
        super().__init__(skin, positions, radius, numbers, rows, columns)
        aside = np.linalg.qr(self.sampler.tangents(skin.rest))[0]
        parts = positions[:, None] + np.einsum('k,kij,jp->kpi', radius, aside, [self._AT.real, self._AT.imag])
        self._parts = SurfaceSampler(np.clip(skin.square_of(parts.reshape(-1, 3)), -1, 1), skin.nodes)
        self._area = np.linalg.norm(np.cross(*np.moveaxis(self._parts.tangents(skin.rest), -1, 0)), axis=-1)

    def seen(self, shape: np.ndarray, camera: SimulatedCamera, correct: Callable | None = None) -> tuple:
        """As DotPattern.seen; the pixels are those of the centroids, and the maps have the area of the image."""
        positions, _, spread = super().seen(shape, camera, correct)
        parts = self._parts.positions(shape)
        uv, slope = camera.project_with_slope(parts if correct is None else correct(parts))
        size = np.abs(np.linalg.det(slope @ self._parts.tangents(shape))) / self._area  # of the image over that of the print
        weight = self._SHARE * size.reshape(-1, len(self._AT))
        area = weight.sum(axis=1, keepdims=True)
        uv = np.einsum('kp,kpi->ki', weight, uv.reshape(*weight.shape, 2)) / area
        return positions, uv, spread * np.sqrt(area[:, :, None] / np.abs(np.linalg.det(spread))[:, None, None])


def uneven(radius: float, spread: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Random radii (count,), m, with mean radius, m, and relative standard deviation spread: printed dots vary in size."""
    return radius * (1 + spread * np.clip(rng.standard_normal(count), -2.5, 2.5))

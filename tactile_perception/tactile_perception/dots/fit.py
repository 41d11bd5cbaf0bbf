# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Model of one printed dot: its image, a blurred disc, and tables for its maximum-likelihood fit in small patches (src/dots/disc.cpp).

The fit's model is linearised at nodes of sub-pixel position and diameter. At each node, the weighted least-squares estimate of the
differences from the node is a matrix applied to the patch. The rows of these matrices span few dimensions, so a patch is projected onto
them once, and every Gauss-Newton step works on these dimensions. Each of them is even or odd along both axes: nodes in one quadrant serve
all four, and a patch is folded first.
"""
from __future__ import annotations

import numpy as np

from ..common.statistics import normal_cdf

_MAX_SIGMAS = 6.0  # standard deviations at which a Gaussian is truncated: 1e-9 lies beyond
# Strips over which a disc is integrated: so many, and so many per radius over blur. The sum over a half circle of angles converges
# exponentially; with these it is within 1e-7 of the brightness for discs of 1.5 to 30 px and any blur (measured).
_STRIPS, _STRIPS_PER_BLUR = 6, 3.2
_PER_PIXEL = 24  # samples of a profile per pixel
_PIXEL_VARIANCE = 1.0 / 12.0  # px^2, of a square pixel


def _profile(radius: np.ndarray, diameter: float, blur: float) -> np.ndarray:
    """Radial profile (N,) of a blurred disc of unit brightness, at rising distances radius (N,) px from its centre.

    diameter: px; blur: px, standard deviation of the optics without the pixel. The disc is integrated over strips, each a difference of
    normal distribution functions, which is exact up to the number of strips.
    """
    s = np.sqrt(blur**2 + _PIXEL_VARIANCE)
    half = diameter / 2
    strips = _STRIPS + int(_STRIPS_PER_BLUR * half / s)
    angle = (np.arange(strips) + 0.5) / strips * np.pi - np.pi / 2
    along, share = half * np.sin(angle), half * np.cos(angle) * np.pi / strips
    chord = 2 * normal_cdf(half * np.cos(angle) / s) - 1
    near = radius[radius < half + _MAX_SIGMAS * s]
    exponent = (near[:, None] - along) / s
    exponent *= exponent
    exponent *= -0.5
    density = np.exp(exponent, out=exponent)
    return np.concatenate([density @ (share * chord / (s * np.sqrt(2 * np.pi))), np.zeros(len(radius) - len(near))])


def _scaled_bessel(x: np.ndarray) -> np.ndarray:
    """(2, N): exp(-x) I0(x) and exp(-x) I1(x), modified Bessel functions, at x (N,) from 0.

    The midpoint rule on their integrals over a half circle converges exponentially: with these nodes the error is below 1e-12.
    """
    nodes = 8 + int(4 * np.sqrt(x.max()))
    cosine = np.cos((np.arange(nodes) + 0.5) * np.pi / nodes)
    return np.exp(np.outer(cosine - 1, x)).T.dot(np.column_stack([np.ones(nodes), cosine])).T / nodes


def disc_modes(x: np.ndarray, y: np.ndarray, diameter: float, blur: float) -> np.ndarray:
    """(7, ...) float64: the image of a disc, and its derivatives by u, v, diameter, blur and two components of ellipticity, at offsets x, y
    (same shape, px) from its centre; diameter, blur: px. By the circle, and by the heat equation by blur, the derivatives are Bessel
    functions."""
    radius = np.hypot(x, y)
    grid = np.arange(int(radius.max() * _PER_PIXEL) + 3) / _PER_PIXEL
    square, half = blur**2 + _PIXEL_VARIANCE, diameter / 2
    edge = half / square * np.exp(-(grid - half)**2 / (2 * square))
    even, odd = edge * _scaled_bessel(grid * half / square)
    table = np.stack([_profile(grid, diameter, blur), odd, even / 2, blur * (grid * odd - half * even) / square])
    share, at = np.modf(radius * _PER_PIXEL)
    at = at.astype(int)
    shape, inward, edge, soft = table[:, at] + share * np.diff(table)[:, at]
    inverse = 1 / np.maximum(radius, 1e-6)
    inward, turn = inward * inverse, edge * inverse**2
    return np.stack([shape, inward * x, inward * y, edge, soft, turn * (x * x - y * y), 2 * turn * x * y])


_PHASES = 4  # nodes from 0 to 1 px along each axis: the model is linear between them to 0.001 px for dots from 5 px
_NODE_DIAMETERS = 0.65  # widths of the blurred edge, greatest spacing of the nodes' diameters. Chosen likewise; dots of 3 px: 0.002 px
_TAIL = 2.2  # blurs outside the dot's edge where the window ends: 1 % of the information about its position lies beyond
_TAPER = 2.0  # px over which the window falls from one to zero
_LEAST_HALF = 3  # px: a smaller patch has fewer independent directions than the basis
_SECTORS = {(1, 1): 12, (1, -1): 8, (-1, 1): 8, (-1, -1): 4}  # parity down and across: dimensions. They shift positions by below 0.001 px
_ITERATIONS = 3  # of a subspace twice as large as the basis: more change positions by below 0.0001 px
_MODELS_FIRST = 1e3  # weight of the dots' images against the rows in the compression, so that its loss causes no bias
_PER_SQUARE = 16.0  # entries of a profile per px^2 of squared radius
_PER_DIAMETER = 10.0  # profiles per px of diameter
_BEYOND = 3.5  # blurs outside its edge where a dot's image ends


class DiscModel:
    """Discs of a range of diameters, imaged with a known blur.

    smallest, largest: diameters, px; blur: standard deviation, px. Construction takes 10 to 60 ms.
    Attributes for the kernel: basis (S, K) of folded patches with sides of 2 half + 1 px; estimators (D, 4, 4, 5, K) for D
    diameters and distances down and across from the middle pixel, of amplitude times du, dv and ddiameter, amplitude and ground; modes
    (D, 4, 4, 10, K), orthonormal, of a dot's image; gains (D, 4, 4) px^2, variance of a position for unit contrast and noise; levers
    (D, 2) px^2, shift by slopes of ground and dot; profile (P, L): images along the squared radius, per_square entries per px^2.
    """

    def __init__(self, smallest: float, largest: float, blur: float):
        edge = np.hypot(blur, 0.3)
        self.diameters = np.linspace(smallest, largest, 2 + int((largest - smallest) / (_NODE_DIAMETERS * edge)))
        self._tail, self.smallest, self.largest, self.blur = _TAIL * edge, float(smallest), float(largest), float(blur)
        self.half = max(_LEAST_HALF, int(np.ceil(largest / 2 + self._tail - 0.3)))
        self.per_square, self.profile = _PER_SQUARE, self._profiles()
        self._make_nodes()

    def _profiles(self) -> np.ndarray:
        """(P, L) float32 images of discs along the squared radius, zero at the end."""
        length = int((self.largest / 2 + _BEYOND * np.hypot(self.blur, 0.3)) ** 2 * _PER_SQUARE) + 1
        radius = np.sqrt(np.arange(length) / _PER_SQUARE)
        diameters = np.linspace(self.smallest, self.largest, 2 + int((self.largest - self.smallest) * _PER_DIAMETER))
        grid = np.arange(int(radius[-1] * _PER_PIXEL) + 2) / _PER_PIXEL
        profile = np.array([np.interp(radius, grid, _profile(grid, diameter, self.blur)) for diameter in diameters], np.float32)
        profile[:, -1] = 0.0
        return profile

    def _make_nodes(self) -> None:
        """Set the tables of all nodes."""
        reach = np.arange(-self.half, self.half + 1, dtype=float)
        modes, windows = (np.concatenate(parts) for parts in zip(*(self._linearised(reach, d) for d in self.diameters)))
        models = modes[:, :, :5]
        weighted = models * windows[:, :, None]
        rows = np.linalg.inv(weighted.transpose(0, 2, 1) @ models) @ weighted.transpose(0, 2, 1)
        basis, self.basis = _compression(rows, models[:, :, 0], self.half)
        shape = len(self.diameters), _PHASES, _PHASES
        gains = np.einsum('nij,nij->n', rows[:, 1:3], rows[:, 1:3]) / 2
        central, x = slice(None, None, _PHASES**2), np.tile(reach, len(reach))
        self.levers = np.stack([rows[central, 1] @ x, (rows[central, 1] * models[central, :, 0]) @ x], axis=1)
        explained = np.linalg.qr(basis.T @ modes)[0].transpose(0, 2, 1)
        estimators = (rows @ basis)[:, [1, 2, 3, 0, 4]]
        self.estimators = np.ascontiguousarray(estimators.reshape(*shape, 5, -1), np.float32)
        self.modes, self.gains = np.ascontiguousarray(explained.reshape(*shape, 10, -1), np.float32), gains.reshape(shape)

    def _linearised(self, reach, diameter):
        """(nodes, pixels, 10) derivatives of a dot's image by amplitude, u, v, diameter, background, its two slopes, blur and two
        components of ellipticity; and (nodes, pixels) windows."""
        phases = np.linspace(0, 1, _PHASES)
        v, u, y, x = np.meshgrid(phases, phases, reach, reach, indexing='ij')
        x, y = (x - u).reshape(_PHASES**2, -1), (y - v).reshape(_PHASES**2, -1)
        edge = np.clip((diameter / 2 + self._tail - np.hypot(x, y)) / _TAPER + 0.5, 0, 1)
        modes = disc_modes(x, y, diameter, self.blur)
        return np.stack([*modes[:4], np.ones_like(x), x, y, *modes[4:]], axis=2), edge * edge * (3 - 2 * edge)


def _compression(rows, images, half):
    """(pixels, K) orthonormal basis of the dots' images and, with less weight, of the rows: leading principal directions of each parity;
    and (S, K) float32, the same for sums of mirrored pixels, where those on an axis count twice."""
    even, models_first = np.ones((1, rows.shape[2])), np.sqrt(_MODELS_FIRST)
    flat, images, even = (part / np.sqrt(np.einsum('ij,ij->i', part, part))[:, None]
                          for part in (rows.reshape(-1, rows.shape[2]).astype(np.float32), images.astype(np.float32), even))
    directions = np.concatenate([flat, models_first * images, models_first * np.sqrt(len(images)) * even]).astype(np.float32)
    side, parts = 2 * half + 1, []
    for parity, dimensions in _SECTORS.items():
        part = directions.reshape(-1, side, side)
        for axis, sign in enumerate(parity, 1):
            part = _folded(part, sign, axis, half)
        vectors = _leading(part.reshape(len(part), -1), dimensions).T.reshape(dimensions, *part.shape[1:])
        for axis, sign in enumerate(parity, 1):
            vectors = _unfolded(vectors, sign, axis)
        parts.append(vectors.reshape(dimensions, -1).T)
    basis = np.concatenate(parts, axis=1)
    folded = basis.reshape(side, side, -1)[half:, half:].copy()
    folded[0] /= 2
    folded[:, 0] /= 2
    return basis, folded.reshape(-1, basis.shape[1]).astype(np.float32)


def _folded(patches, sign, axis, half):
    """Sums (sign 1) or differences of mirrored pixels along an axis, in an orthonormal basis; those on the middle have no difference."""
    patches = np.moveaxis(patches, axis, 0)
    pairs = (patches[half + 1:] + sign * patches[half - 1::-1]) / np.sqrt(2)
    return np.moveaxis(np.concatenate([patches[half:half + 1], pairs]) if sign > 0 else pairs, 0, axis)


def _unfolded(patches, sign, axis):
    """The inverse of `_folded`."""
    patches = np.moveaxis(patches, axis, 0)
    middle, pairs = (patches[:1], patches[1:]) if sign > 0 else (np.zeros_like(patches[:1]), patches)
    return np.moveaxis(np.concatenate([sign * pairs[::-1], np.sqrt(2) * middle, pairs]) / np.sqrt(2), 0, axis)


def _leading(rows, count):
    """(M, count) orthonormal: leading principal directions of rows (N, M), by subspace iteration (Golub and Van Loan, Matrix Computations,
    8.2): eigenvectors of the whole matrix would take ten times as long."""
    square = (rows.T @ rows).astype(float)
    block = np.random.default_rng(0).normal(size=(len(square), 2 * count))
    for _ in range(_ITERATIONS):
        block = np.linalg.qr(square @ block)[0]
    return block @ np.linalg.eigh(block.T @ square @ block)[1][:, :-count - 1:-1]

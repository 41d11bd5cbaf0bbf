# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Maximum-likelihood place, size and contrast of dots in small patches, all dots at once.

A dot is a blurred disc (shape.py) of unknown place, diameter, amplitude and ground. Around each of a few hundred nodes (sub-pixel place and diameter) the best
linear estimate of the differences is a matrix of rows over the patch. The rows of all nodes span few dimensions: patches are projected on these once, and
every Newton step afterwards works on some fifty numbers a dot.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import as_strided

from .shape import blurred_disc

_PER_PIXEL = 3  # nodes a pixel along each axis: linear in between to 0.001 px
_REACH = 3  # nodes each way of the patch's centre
_SIDE = 2 * _REACH + 1
_DERIVATIVE_STEP = 0.02  # px
_TAIL = 2.2  # the window ends this many blurs outside the dot's edge: 1 % of the knowledge of its place is beyond
_TAPER = 2.0  # px over which the window falls from one to zero
_DIMENSIONS = 48  # of the compression: shifts places by less than 0.001 px
_MODELS_FIRST = 1e3  # weight of the dots' images against the rows in the compression: what it loses must not bias
_STEPS = 3


@dataclass
class Fit:
    """Fitted dots, (N,) each: places u, v and diameter in px; amplitude (dot minus ground) and ground in grey levels; node: of the last step."""

    u: np.ndarray
    v: np.ndarray
    diameter: np.ndarray
    amplitude: np.ndarray
    ground: np.ndarray
    node: np.ndarray


class LikelihoodFitter:
    """Fits discs of diameters in a range, seen through a known blur.

    smallest, largest: diameters, px; blur: standard deviation, px. Building the tables takes a few tenths of a second.
    """

    def __init__(self, smallest: float, largest: float, blur: float):
        self.blur = blur
        self.diameters = np.linspace(smallest, largest, 2 + int((largest - smallest) / 0.6))
        self._spacing = self.diameters[1] - self.diameters[0]
        self._tail = _TAIL * np.hypot(blur, 0.3)
        self.half = int(np.ceil(largest / 2 + self._tail + 0.5))
        self._build()

    def patches(self, padded: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(N, P) float32 squares of 2 half + 1 px a side about whole pixels of an image that is padded by half."""
        side = 2 * self.half + 1
        height, width = padded.shape
        views = as_strided(padded, (height - side + 1, width - side + 1, side, side), padded.strides * 2)
        return views[row, column].reshape(len(row), -1).astype(np.float32)

    def fit(self, patches: np.ndarray, diameter: np.ndarray, u=0.0, v=0.0) -> Fit:
        """Newton steps from a place (u, v; (N,) px from the patches' centres) and a diameter ((N,) px)."""
        compressed = patches @ self.basis
        u, v = np.broadcast_to(u, len(patches)), np.broadcast_to(v, len(patches))
        for _ in range(_STEPS):
            node, u0, v0, d0 = self._nearest(u, v, diameter)
            amplitude, du, dv, dd, ground = np.matmul(self._rows[node], compressed[:, :, None])[:, :, 0].T.astype(float)
            scale = np.where(np.abs(amplitude) > 1e-3, amplitude, 1e-3)
            u = u0 + np.clip(du / scale, -0.7, 0.7)
            v = v0 + np.clip(dv / scale, -0.7, 0.7)
            diameter = d0 + np.clip(dd / scale, -1.5, 1.5)
        return Fit(u, v, diameter, amplitude, ground, node)

    def correct_slope(self, fit: Fit, slope_u: np.ndarray, slope_v: np.ndarray):
        """Take off what a ground sloping by these shares of itself a pixel ((N,) each) did to the places; light falls on dot and ground alike."""
        size = fit.node // (_SIDE * _SIDE)
        amplitude = np.where(np.abs(fit.amplitude) > 1e-3, fit.amplitude, 1e-3)
        lever = self._ground_lever[size] * fit.ground / amplitude + self._dot_lever[size]
        fit.u = fit.u - lever * slope_u
        fit.v = fit.v - lever * slope_v

    def variances(self, patches: np.ndarray, fit: Fit) -> np.ndarray:
        """(N,) variance of the pixels about the fit, in the windows; slopes of the ground do not count."""
        models = self._models[fit.node]
        u0, v0, d0 = self._place(fit.node)
        amplitude = fit.amplitude
        factors = np.stack([amplitude, amplitude * (fit.u - u0), amplitude * (fit.v - v0), amplitude * (fit.diameter - d0)], 1).astype(np.float32)
        rest = patches[:, self._half_of_all] - np.matmul(factors[:, None, :], models)[:, 0] - fit.ground[:, None].astype(np.float32)
        window = self._windows[fit.node]
        weighted = rest * window
        tilt = weighted @ self._tilts
        total = np.einsum('ij,ij->i', weighted, rest) - tilt[:, 0] ** 2 / self._tilt_norm[fit.node, 0] - tilt[:, 1] ** 2 / self._tilt_norm[fit.node, 1]
        return np.maximum(total, 0) / self._freedom[fit.node]

    def gains(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Variance of a place along an axis (px^2) and of a diameter (px^2), both (N,), per pixel variance of one."""
        per = self._gain[fit.node] / np.maximum(fit.amplitude**2, 1e-6)[:, None]
        return (per[:, 1] + per[:, 2]) / 2, per[:, 3]

    def _nearest(self, u, v, diameter):
        column = np.clip(np.rint(u * _PER_PIXEL), -_REACH, _REACH)
        row = np.clip(np.rint(v * _PER_PIXEL), -_REACH, _REACH)
        size = np.clip(np.rint((diameter - self.diameters[0]) / self._spacing), 0, len(self.diameters) - 1)
        node = ((size * _SIDE + row + _REACH) * _SIDE + column + _REACH).astype(np.int64)
        return node, column / _PER_PIXEL, row / _PER_PIXEL, self.diameters[0] + size * self._spacing

    def _place(self, node):
        size, rest = np.divmod(node, _SIDE * _SIDE)
        row, column = np.divmod(rest, _SIDE)
        return (column - _REACH) / _PER_PIXEL, (row - _REACH) / _PER_PIXEL, self.diameters[size]

    def _build(self):
        reach = np.arange(-self.half, self.half + 1, dtype=float)
        nodes = [self._node(reach, *place) for place in zip(*self._place(np.arange(len(self.diameters) * _SIDE * _SIDE)))]
        models, windows = np.array([n[0] for n in nodes]), np.array([n[1] for n in nodes])
        weighted = models * windows[:, :, None]
        rows = np.linalg.solve(weighted.transpose(0, 2, 1) @ models, weighted.transpose(0, 2, 1))
        self._gain = np.einsum('nij,nij->ni', rows, rows)
        self.basis = _compression(rows, models)
        self._rows = (rows @ self.basis).astype(np.float32)
        self._build_levers(reach, rows, models)
        self._build_residuals(reach, models, windows)

    def _build_levers(self, reach, rows, models):
        x = np.tile(reach, len(reach))
        central = _SIDE * _SIDE * np.arange(len(self.diameters)) + _SIDE * _SIDE // 2
        self._ground_lever = rows[central, 1] @ x
        self._dot_lever = (rows[central, 1] * models[central, :, 0]) @ x

    def _build_residuals(self, reach, models, windows):
        """Half of the pixels, in the pattern of a chessboard, tell the noise well enough."""
        x, y = (a.ravel() for a in np.meshgrid(reach, reach))
        half = self._half_of_all = np.flatnonzero((x + y) % 2 == 0)
        self._models = np.ascontiguousarray(models[:, half, :4].transpose(0, 2, 1), np.float32)
        self._windows = windows[:, half].astype(np.float32)
        self._tilts = np.stack([x[half], y[half]], 1).astype(np.float32)
        self._tilt_norm = self._windows @ self._tilts**2
        count = windows.sum(1)
        self._freedom = self._windows.sum(1) * (1 - 7 / count)

    def _node(self, reach, u, v, diameter):
        """(P, 5) derivatives of a dot's image by amplitude, u, v, diameter and ground, and its (P,) window."""
        x, y = (a.ravel() for a in np.meshgrid(reach - u, reach - v))
        h = _DERIVATIVE_STEP
        radius = np.hypot(x, y)
        shape = blurred_disc(np.stack([radius, np.hypot(x - h, y), np.hypot(x + h, y), np.hypot(x, y - h), np.hypot(x, y + h)]), diameter, self.blur)
        wider = blurred_disc(radius, diameter + h, self.blur) - blurred_disc(radius, diameter - h, self.blur)
        model = np.stack([shape[0], (shape[1] - shape[2]) / (2 * h), (shape[3] - shape[4]) / (2 * h), wider / (2 * h), np.ones_like(radius)], 1)
        edge = np.clip((diameter / 2 + self._tail - radius) / _TAPER + 0.5, 0, 1)
        return model, edge * edge * (3 - 2 * edge)


def _compression(rows, models):
    """(P, K) orthonormal directions that hold the dots' images and, less strictly, the rows."""
    flat = rows.reshape(-1, rows.shape[2])
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    images = models[:, :, 0] / np.linalg.norm(models[:, :, 0], axis=1, keepdims=True)
    even = np.full(rows.shape[2], rows.shape[2] ** -0.5)
    spread = flat.T @ flat + _MODELS_FIRST * (images.T @ images + len(images) * np.outer(even, even))
    _, axes = np.linalg.eigh(spread)
    return np.ascontiguousarray(axes[:, ::-1][:, :_DIMENSIONS], np.float32)

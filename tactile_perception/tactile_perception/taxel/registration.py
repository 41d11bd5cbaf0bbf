# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Registration of a contact's image with a keyframe: a robust fit of rigid motion and growth to the normal flow of its edges.

Gauss-Newton on intensity residuals (Lucas and Kanade). Growth along the edges' normals is fitted too, since a change of load makes a
contact grow or shrink without motion.
"""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._core import taxel_edges, taxel_register

_EDGE = 0.08  # gradient of an image, 1/taxel, from which a taxel belongs to an edge. Chosen
_FEWEST, _MOST = 6, 250  # edge taxels: needed (4 unknowns), and used at most (bounds the time). Chosen
_MIN_SIGMA = 0.015  # least standard deviation of the image's residuals. Chosen
# Least information on a shift, relative to the best direction: the rough edge of a half plane has up to 0.06, a bar of 5 : 2 has 0.4. And
# on a rotation: a face of 3 : 2 has 0.06, a ring has only that of its roughness, which is larger where edges are few (plus _ROUGHNESS over
# their number).
_MIN_SHIFT_INFORMATION, _MIN_TURN_INFORMATION, _ROUGHNESS = 0.08, 0.035, 3.0
_LARGE = 20  # taxels, from which two at the array's border are ignored, else one. Chosen
_CENTROID_SIGMA = 0.3  # taxels, standard deviation of the centroid of a contact of few taxels: pressure shifts without motion. Chosen
_FAR = 5.0  # taxels, largest motion since a keyframe. Chosen: farther the fit does not converge
# The fit holds if the standard deviation of its residuals is below the first, and the part of inliers above the second. Chosen.
_MAX_SIGMA, _MIN_INLIERS = 0.2, 0.7


class KeyframeMotion(NamedTuple):
    """Motion since the keyframe: a point p (column, row, taxels) of the contact moves to middle + R(turn) (p - middle) + shift.

    fit: (4,) taxels, shift along columns and rows, turn times reach, growth along the edges' normals; turn: rad, NaN where unobservable;
    spread: standard deviation of the image's residuals; reach: distance of far edges from middle, taxels; sigma: standard deviation of the
    registered position, taxels.
    """

    fit: np.ndarray
    turn: float
    spread: float
    middle: np.ndarray
    reach: float
    sigma: float

    @property
    def shift(self) -> np.ndarray:
        """(2,) column and row, taxels."""
        return self.fit[:2]

    @property
    def growth(self) -> float:
        """Taxels along the edges' normals."""
        return float(self.fit[3])

    @property
    def known_turn(self) -> float:
        """rad, 0 where unobservable."""
        return 0.0 if math.isnan(self.turn) else self.turn

    @property
    def largest(self) -> float:
        """Largest displacement, taxels."""
        return math.hypot(self.fit[0], self.fit[1]) + abs(self.known_turn) * self.reach


class Keyframe:
    """An image that later ones are registered with: positive pressure (rows, columns) float32 times scale, about 0.8 in a contact."""

    def __init__(self, pressure: np.ndarray, scale: float = 1.0):
        rim = 2 if min(pressure.shape) >= _LARGE else 1  # what moves over the array's border is not seen: ignore it
        *self._edges, normal, middle, self.reach, count = taxel_edges(pressure, scale=scale, steep=_EDGE, rim=rim, most=_MOST)
        self._row_column, self.middle = middle, middle[::-1]
        self._turns = self._determined(normal, count) if count >= _FEWEST else None

    def motion(self, pressure: np.ndarray, scale: float = 1.0, start: np.ndarray | None = None) -> KeyframeMotion | None:
        """The motion from the keyframe to the image by pressure and scale; start: predicted fit (4,). None where the fit fails."""
        if self._turns is None:
            return None
        fit, spread, inliers = taxel_register(pressure, *self._edges, self._row_column, self.reach, scale=scale, turns=self._turns,
                                              guess=np.zeros(4) if start is None else start)
        along, across, turned, _ = fit.tolist()
        if not (math.hypot(along, across) + abs(turned) <= _FAR and spread <= _MAX_SIGMA and inliers >= _MIN_INLIERS):
            return None
        turn = turned / self.reach if self._turns else math.nan
        return KeyframeMotion(fit, turn, spread, self.middle, self.reach, spread * self._position_sigma)

    def _determined(self, normal: np.ndarray, count: int) -> bool | None:
        """Whether the edges determine a turn, from the products of their slopes (4, 4); None where a shift is unobservable."""
        xx, xy, yy = normal[0, 0], normal[0, 1], normal[1, 1]
        total, apart = xx + yy, math.hypot(xx - yy, 2 * xy)
        if total - apart < _MIN_SHIFT_INFORMATION * (total + apart):
            return None
        x, y = normal[2, :2]
        turning = normal[2, 2] - (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        turns = bool(turning > (_MIN_TURN_INFORMATION + _ROUGHNESS / count) * total)
        used = [0, 1, 2, 3] if turns else [0, 1, 3]
        covariance = np.linalg.pinv(normal[used][:, used], hermitian=True)[:-1, :-1]
        self._position_sigma = math.sqrt(np.linalg.eigvalsh(covariance)[-1])
        return turns


class KeyCentroid:
    """Keyframe of a contact of few taxels, registered by the centroid of pressure (rows, columns) in touched (rows, columns) bool."""

    def __init__(self, pressure: np.ndarray, touched: np.ndarray):
        self._pressure, self._touched = pressure, touched
        self.middle, self.reach = _centroid(pressure, touched), 1.0

    def motion(self, pressure: np.ndarray, touched: np.ndarray) -> KeyframeMotion | None:
        """The motion from the keyframe to pressure (rows, columns) where touched; None for a jump. Both centroids are taken over the taxels
        that either touches: one that crosses the border moves no centroid at once."""
        either = touched | self._touched
        shift = _centroid(pressure, either) - _centroid(self._pressure, either)
        if not np.hypot(*shift) < _FAR:
            return None
        return KeyframeMotion(np.array([*shift, 0.0, 0.0]), np.nan, _MIN_SIGMA, self.middle, self.reach, _CENTROID_SIGMA)


def _centroid(pressure: np.ndarray, touched: np.ndarray) -> np.ndarray:
    row, column = np.nonzero(touched)
    weight = np.maximum(pressure[row, column], 0) + 1e-12
    return np.array([weight @ column, weight @ row]) / weight.sum()

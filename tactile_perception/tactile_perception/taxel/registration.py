# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How far a contact's picture has moved and turned since a key picture: a robust rigid fit to the flow across its edges.

Where the picture has a gradient, its change tells the flow along it (Lucas and Kanade's normal flow); a rigid motion of all edges, and a
growth of the contact along their normals, are fitted to it at once. A change of load makes a contact grow or shrink, and is no motion.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.linalg.lapack import dposv
from scipy.ndimage import map_coordinates

from ..common.statistics import SIGMA_PER_MAD, upper_median

_EDGE = 0.08  # gradient of a score, 1/taxel, from which a taxel belongs to an edge
_FEWEST, _MOST = 6, 250  # edge taxels; of more, some are followed
_ROUNDS = 4
_SETTLED = 0.04  # taxels: a step of so much is right to a tenth
_TUKEY = 4.685
_SPREAD = 0.015  # least standard deviation of a score that is expected
# Information on a direction, of that on the best one, under which it is open, and on a turn: a face of 3 : 2 has 0.06, a ring none but what
# its roughness tells, which is more where edges are few.
_OPEN, _OPEN_TURN, _FEW = 0.02, 0.035, 3.0
_REACHED = 0.9  # part of the edges that is within reach: a few beside the contact must not count
_LARGE = 20  # taxels, from which an array can do without two at its rim
_CENTRE_DOUBT = 0.3  # taxels: pressure shifts within a contact of a few, though nothing moves
_FAR = 5.0  # taxels: what has moved farther is not found from the last place
# Two pictures are of one object's motion where the score is left with less than the first (a standard deviation), at more than the second
# of the edges.
_ALIKE, _AGREED = 0.2, 0.7
# A picture is taken as the sum of a cubic B-spline at each taxel, times its score: its values and slopes at the taxels.
_SPLINE, _SLOPE = np.float32([1 / 6, 2 / 3, 1 / 6]), np.float32([-0.5, 0, 0.5])


@dataclass(frozen=True)
class PictureMotion:
    """Motion since the key: a point of the contact at p (column, row, taxels) comes to middle + R(turn) (p - middle) + shift.

    fit: (4,) taxels, shift along columns and rows, turn times reach, growth along the edges' normals; turn: rad, NaN where the picture does
    not tell; spread: standard deviation of what is left of the score; reach: distance of far edges from the middle, taxels; sigma:
    standard deviation of an edge's place by all of it, taxels.
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
        """rad, 0 where it is not told."""
        return 0.0 if math.isnan(self.turn) else self.turn

    @property
    def largest(self) -> float:
        """Largest displacement, taxels."""
        return math.hypot(*self.shift) + abs(self.known_turn) * self.reach


class KeyPicture:
    """A picture to which later ones are compared. score: (rows, columns) float32."""

    def __init__(self, score: np.ndarray):
        gx = cv2.sepFilter2D(score, -1, _SLOPE, _SPLINE, borderType=cv2.BORDER_REPLICATE)
        gy = cv2.sepFilter2D(score, -1, _SPLINE, _SLOPE, borderType=cv2.BORDER_REPLICATE)
        steep = np.sqrt(gx * gx + gy * gy)  # cv2.magnitude rounds by where the arrays lie in memory
        # The array's rim tells nothing: what leaves it there is not seen.
        rim = 2 if min(score.shape) >= _LARGE else 1
        steep[:rim], steep[-rim:], steep[:, :rim], steep[:, -rim:] = 0, 0, 0, 0
        rows, columns = np.nonzero(steep > _EDGE)
        self._used, self.middle, self.reach = None, np.zeros(2), 1.0
        if len(rows) < _FEWEST:
            return
        place = np.stack([rows, columns]).astype(float)
        self.middle = place.mean(axis=1)[::-1]
        arm = place - self.middle[::-1, None]
        gx, gy, steep = gx[rows, columns], gy[rows, columns], steep[rows, columns]
        far = round(_REACHED * (len(rows) - 1))
        self.reach = math.sqrt(float(np.partition(np.sum(arm * arm, axis=0), far)[far]))
        # Columns: shift along columns and rows, turn (times the reach), growth.
        slopes = np.stack([gx, gy, (arm[1] * gy - arm[0] * gx) / self.reach, -steep], axis=1).astype(float)
        self._used = self._determined(slopes)
        if self._used is None:
            return
        step = -(-len(rows) // _MOST)
        thin = np.flatnonzero((rows + columns) % step == 0)  # evenly over all edges, along whichever axis they run
        value = cv2.sepFilter2D(score, -1, _SPLINE, _SPLINE, borderType=cv2.BORDER_REPLICATE)[rows[thin], columns[thin]].astype(float)
        self._place, self._arm, self._value = place[:, thin], arm[:, thin], value
        self._growth, self._slopes = slopes[thin, 3], slopes[thin][:, self._used]

    def motion(self, score: np.ndarray, start: np.ndarray | None = None) -> PictureMotion | None:
        """The motion from the key to score (rows, columns) float32; start: fit (4,) that is expected. None where the pictures do not
        tell."""
        if self._used is None:
            return None
        guess = np.zeros(4) if start is None else start.copy()
        for _ in range(_ROUNDS):
            left = self._value - self._sampled(score, guess)
            size = np.abs(left)
            spread = max(SIGMA_PER_MAD * upper_median(size), _SPREAD)
            step = self._step(left, spread)
            guess[self._used] += step
            if np.abs(step).max() < _SETTLED:
                break
        if not np.isfinite(guess).all() or math.hypot(*guess[:2]) + abs(guess[2]) > _FAR or spread > _ALIKE or \
                np.count_nonzero(size < _TUKEY * spread) < _AGREED * len(size):
            return None
        turn = guess[2] / self.reach if 2 in self._used else np.nan
        return PictureMotion(guess, float(turn), spread, self.middle, self.reach, spread * self._doubt)

    def _determined(self, slopes: np.ndarray) -> list[int] | None:
        """The columns of slopes (M, 4) that the key's edges determine; None where a shift is open."""
        normal = slopes.T @ slopes
        xx, xy, yy = normal[0, 0], normal[0, 1], normal[1, 1]
        total, apart = xx + yy, math.hypot(xx - yy, 2 * xy)
        if total - apart < _OPEN * (total + apart):
            return None
        x, y = normal[2, :2]
        turning = normal[2, 2] - (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        used = [0, 1, 2, 3] if turning > (_OPEN_TURN + _FEW / len(slopes)) * total else [0, 1, 3]
        covariance = np.linalg.pinv(normal[used][:, used], hermitian=True)[:-1, :-1]
        self._doubt = math.sqrt(np.linalg.eigvalsh(covariance)[-1])
        return used

    def _sampled(self, score: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """score where the key's edges are by guess, without its growth, which is linear."""
        place = self._place + guess[1::-1, None]
        if guess[2]:
            cosine, sine = math.cos(guess[2] / self.reach) - 1, math.sin(guess[2] / self.reach)
            place += np.array([[cosine, sine], [-sine, cosine]]) @ self._arm
        return map_coordinates(score, place, np.float64, order=3, mode='nearest', prefilter=False) + self._growth * guess[3]

    def _step(self, left: np.ndarray, spread: float) -> np.ndarray:
        """Step of the used columns, by Tukey's biweight from the present residuals (M,)."""
        weight = left * (1 / (_TUKEY * spread))
        weight = np.maximum(1 - weight * weight, 0)
        weight *= weight
        weighed = self._slopes.T * weight
        normal = weighed @ self._slopes
        diagonal = normal.ravel()[::len(normal) + 1]
        diagonal += 1e-9 * diagonal.sum() + 1e-12
        return dposv(normal, weighed @ left)[1]


class KeyCentre:
    """As KeyPicture, for a contact of so few taxels that it has no edges: what moves is its pressure's centre. pressure: (rows, columns);
    touched: (rows, columns) bool, not empty."""

    def __init__(self, pressure: np.ndarray, touched: np.ndarray):
        self.middle, self.reach = _centre(pressure, touched), 1.0

    def motion(self, pressure: np.ndarray, touched: np.ndarray) -> PictureMotion | None:
        """The motion from the key to pressure where touched; None for a jump."""
        shift = _centre(pressure, touched) - self.middle
        if not np.hypot(*shift) < _FAR:
            return None
        return PictureMotion(np.array([*shift, 0.0, 0.0]), np.nan, _SPREAD, self.middle, self.reach, _CENTRE_DOUBT)


def _centre(pressure: np.ndarray, touched: np.ndarray) -> np.ndarray:
    row, column = np.nonzero(touched)
    weight = np.maximum(pressure[row, column], 0) + 1e-12
    return np.array([weight @ column, weight @ row]) / weight.sum()

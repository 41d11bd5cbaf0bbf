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

_EDGE = 0.08  # gradient of a score, 1/taxel, from which a taxel belongs to an edge
_FEWEST, _MOST = 6, 1500  # edge taxels
_ROUNDS = 4
_SETTLED = 5e-3  # taxels
_TUKEY = 4.685
_SPREAD = 0.03  # least standard deviation of a score that is expected
# Information on a direction, of that on the best one, under which it is open, and on a turn: a face of 3 : 2 has 0.06, a ring none but what
# its roughness tells, which is more where edges are few.
_OPEN, _OPEN_TURN, _FEW = 0.02, 0.035, 3.0
_LARGE = 20  # taxels, from which an array can do without two at its rim
_CENTRE_DOUBT = 0.3  # taxels: pressure shifts within a contact of a few, though nothing moves
_FAR = 5.0  # taxels: what has moved farther is not found from the last place
# Two pictures are of one object's motion where the score is left with less than the first (a standard deviation), at more than the second
# of the edges.
_ALIKE, _AGREED = 0.2, 0.7


_BORDER = 3


def bordered(picture: np.ndarray) -> np.ndarray:
    """picture (rows, columns) with what is on its rim gone on with, for read_between."""
    return cv2.copyMakeBorder(picture, _BORDER, _BORDER, _BORDER, _BORDER, cv2.BORDER_REPLICATE)


def read_between(picture: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(M,) values of a bordered picture at column x and row y (M,) of the plain one, by Catmull and Rom's cubic."""
    rows, columns = picture.shape
    x = np.minimum(np.maximum(x + _BORDER, 1), columns - 2.001)
    y = np.minimum(np.maximum(y + _BORDER, 1), rows - 2.001)
    left, top = x.astype(np.intp), y.astype(np.intp)
    across, down = _cubic(x - left), _cubic(y - top)
    near = picture.ravel().take(_offsets(columns) + (left + top * columns))
    return ((near * across).sum(axis=1) * down).sum(axis=0)


def _offsets(columns: int) -> np.ndarray:
    """(4, 4, 1) steps in a flat picture from a place to those around it."""
    return _FOUR[:, None] * columns + _FOUR


_FOUR = np.arange(-1, 3)[:, None]
_CUBIC = 0.5 * np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1.0]])


def _cubic(part: np.ndarray) -> np.ndarray:
    """(4, M) weights of four neighbours at a part (M,) of the way between the middle two."""
    square = part * part
    cube = square * part
    return _CUBIC @ np.array([np.ones_like(part), part, square, cube])


@dataclass(frozen=True)
class PictureMotion:
    """Motion since the key: a point of the contact at p (column, row, taxels) comes to middle + R(turn) (p - middle) + shift.

    shift: (2,) column and row, taxels; turn: rad, NaN where the picture does not tell; growth: taxels along the edges' normals; spread:
    standard deviation of what is left of the score; reach: largest distance of an edge from the middle, taxels; sigma: standard deviation
    of an edge's place by all of it, taxels.
    """

    shift: np.ndarray
    turn: float
    growth: float
    spread: float
    middle: np.ndarray
    reach: float
    sigma: float

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
        self.score = score
        # A picture is differentiated as it is interpolated: between neighbours two apart.
        gx = np.zeros_like(score)
        gy = np.zeros_like(score)
        gx[:, 1:-1] = 0.5 * (score[:, 2:] - score[:, :-2])
        gy[1:-1] = 0.5 * (score[2:] - score[:-2])
        steep = np.hypot(gx, gy)
        # The array's rim tells nothing: what leaves it there is not seen.
        rim = 2 if min(score.shape) >= _LARGE else 1
        steep[:rim], steep[-rim:], steep[:, :rim], steep[:, -rim:] = 0, 0, 0, 0
        rows, columns = np.nonzero(steep > _EDGE)
        thin = slice(None, None, 1 + len(rows) // _MOST)
        rows, columns = rows[thin], columns[thin]
        self._place = np.stack([columns, rows]).astype(np.float32)
        self._used, self.middle, self.reach = None, np.zeros(2), 1.0
        if len(rows) < _FEWEST:
            return
        self.middle = self._place.mean(axis=1, dtype=float)
        arm = self._place - self.middle[:, None].astype(np.float32)
        gx, gy = gx[rows, columns], gy[rows, columns]
        self.reach = float(np.hypot(*arm).max())
        # Columns: shift along columns and rows, turn (times the reach), growth.
        self._slopes = np.stack([gx, gy, (arm[0] * gy - arm[1] * gx) / self.reach, -np.hypot(gx, gy)], axis=1).astype(float)
        self._arm, self._value = arm, score[rows, columns]
        self._used = self._determined()

    def motion(self, score: np.ndarray, start: PictureMotion | None = None) -> PictureMotion | None:
        """The motion from the key to score (rows, columns); start: that of the last frame. None where the pictures do not tell."""
        if self._used is None:
            return None
        used = self._used
        guess = np.zeros(4) if start is None else np.array([*start.shift, start.known_turn * self.reach, start.growth])
        score = bordered(score)
        for _ in range(_ROUNDS):
            left = self._value - self._sampled(score, guess)
            step, spread = self._solve(left, used)
            guess[used] += step
            if np.abs(step).max() < _SETTLED:
                break
        if not np.isfinite(guess).all() or math.hypot(*guess[:2]) + abs(guess[2]) > _FAR or spread > _ALIKE or \
                np.mean(np.abs(left) < _TUKEY * spread) < _AGREED:
            return None
        turn = guess[2] / self.reach if 2 in used else np.nan
        return PictureMotion(guess[:2], float(turn), float(guess[3]), spread, self.middle, self.reach, spread * self._doubt)

    def _determined(self) -> list[int] | None:
        """The columns that the key's edges determine; None where a shift is open."""
        normal = self._slopes.T @ self._slopes
        shifts = np.linalg.eigvalsh(normal[:2, :2])
        if shifts[0] < _OPEN * shifts[1]:
            return None
        turning = normal[2, 2] - normal[2, :2] @ np.linalg.solve(normal[:2, :2], normal[:2, 2])
        used = [0, 1, 2, 3] if turning > (_OPEN_TURN + _FEW / len(self._value)) * shifts.sum() else [0, 1, 3]
        covariance = np.linalg.pinv(normal[np.ix_(used, used)])[:-1, :-1]
        self._doubt = float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
        return used

    def _sampled(self, score: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """score where the key's edges are by guess, without its growth, which is linear."""
        cosine, sine = np.cos(guess[2] / self.reach), np.sin(guess[2] / self.reach)
        x = self._place[0] + np.float32(guess[0]) + (cosine - 1) * self._arm[0] - sine * self._arm[1]
        y = self._place[1] + np.float32(guess[1]) + sine * self._arm[0] + (cosine - 1) * self._arm[1]
        return read_between(score, x, y) + self._slopes[:, 3] * guess[3]

    def _solve(self, left: np.ndarray, used: list[int]) -> tuple[np.ndarray, float]:
        """Step of the used columns, by Tukey's biweight from the present residuals."""
        size = np.abs(left)
        spread = max(1.4826 * float(np.partition(size, len(size) // 2)[len(size) // 2]), _SPREAD)
        weight = np.maximum(1 - (left * (1 / (_TUKEY * spread)))**2, 0)**2
        slopes = self._slopes if len(used) == 4 else self._slopes[:, used]
        normal = (slopes * weight[:, None]).T @ slopes
        normal[np.diag_indices(len(used))] += 1e-9 * np.trace(normal) + 1e-12
        return np.linalg.solve(normal, slopes.T @ (weight * left)), spread


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
        return PictureMotion(shift, np.nan, 0.0, _SPREAD, self.middle, self.reach, _CENTRE_DOUBT)


def _centre(pressure: np.ndarray, touched: np.ndarray) -> np.ndarray:
    row, column = np.nonzero(touched)
    weight = np.maximum(pressure[row, column], 0) + 1e-12
    return np.array([weight @ column, weight @ row]) / weight.sum()

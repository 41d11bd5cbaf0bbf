# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How a dome's surface moves under a round tip, learned from presses, whatever the place: displacement as a function of where a point lies
as seen from the touch.

The dome is a sphere, so a dent is much the same wherever it is, but for the slope on which the tip comes down. Vertical, outward and
sideways displacement are splines of the angle from the touch, times the first harmonics of the direction, each with the power of the
slope's sine that symmetry asks for, times a parabola in depth. What a camera sees of all this is linear in the splines' coefficients.
"""
from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from ..surface.cap import Cap

KNOTS = np.array([0.0, 0.045, 0.09, 0.135, 0.18, 0.235, 0.3, 0.375, 0.48, 0.62, 0.81, 1.1])  # rad from the touch
NEAR = 0.065                      # rad: within this, directions fade, since at the touch itself there is none
ORDERS = 3                        # of depth
ORDER_RIDGE = np.array([0.2, 1.0, 3.0])
RIDGES = 10.0 ** np.arange(-7, 0)  # of the data's own weight, against large coefficients
ROUGH = 30.0                      # times that, against kinks along the splines
FOLDS = 3
MODES = 8
X, Y, LOG_DEPTH, LOG_SHAPE, BUMP = range(5)  # parameters of a dent: tip m, log amplitude, log depth its shape is taken from, extra depth m
BUMP_WIDTH = 0.12                 # rad


class Dent:
    """rest: (K, 2) m, eye: (K, 3) m as in MarkerField, points: (K, 3) m on the dome. towards: part of the way from tip to apex at which the
    touch lies; unit: m, of depth. coefficients: (MODES, ORDERS, splines), None while being learned.
    """

    def __init__(self, rest: np.ndarray, eye: np.ndarray, points: np.ndarray, cap: Cap, plane_z: float, towards: float, unit: float,
                 coefficients: np.ndarray | None = None):
        self.cap, self.towards, self.unit, self.coefficients = cap, towards, unit, coefficients
        self.out, self.height, self.level = rest - eye[:, :2], plane_z - eye[:, 2], points[:, 2] - eye[:, 2]
        self.place = self.out * (self.level / self.height)[:, None]
        self._from_centre = points - [0.0, 0.0, cap.centre_z]
        self.table, self.step = _spline_table()

    def appear(self, dent: np.ndarray) -> np.ndarray:
        """(K, 2) m, apparent displacement under a dent with parameters (5,)."""
        angle, modes = self._modes(dent[:2])
        powers = np.exp(dent[LOG_DEPTH]) / self.unit * (np.exp(dent[LOG_SHAPE]) / self.unit) ** np.arange(ORDERS)
        size = self._splines(angle) @ np.einsum('mos,o->sm', self.coefficients, powers)
        moved = np.einsum('km,kmc->kc', size, modes)
        moved[:, 2] -= dent[BUMP] * np.exp(-0.5 * (angle / BUMP_WIDTH)**2)
        return (self.place + moved[:, :2]) * (self.height / (self.level + moved[:, 2]))[:, None] - self.out

    def equations(self, shift: np.ndarray, place: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
        """Rows (2 n, MODES * ORDERS * splines), and what they should give (2 n,), m, for a press whose shift (K, 2)
        was seen at n markers.
        """
        angle, modes = self._modes(place)
        seen = np.isfinite(shift).all(1) & np.isfinite(angle)
        slope = (self.out + shift) / self.level[:, None]
        along = (self.height / self.level)[:, None, None] * modes[..., :2] - modes[..., 2:] * slope[:, None]
        powers = depth / self.unit * (depth / self.unit) ** np.arange(ORDERS)
        rows = np.einsum('kmc,o,ks->kcmos', along[seen], powers, self._splines(angle[seen]))
        return rows.reshape(2 * seen.sum(), -1), shift[seen].ravel()

    def _splines(self, angle: np.ndarray) -> np.ndarray:
        position = np.clip(np.nan_to_num(angle, nan=KNOTS[-1]) / self.step, 0, len(self.table) - 1.001)
        low = position.astype(int)
        part = (position - low)[:, None]
        return self.table[low] * (1 - part) + self.table[low + 1] * part

    def _modes(self, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles (K,) rad from the touch, and the directions (K, MODES, 3) of the modes."""
        place = tip * (1 - self.towards)
        reach = float(np.hypot(*place))
        along = place / reach if reach > 1e-9 else np.array([1.0, 0.0])
        sine = min(reach / self.cap.curvature_radius, 0.95)
        cosine = np.sqrt(1 - sine**2)
        x, y = self._from_centre[:, :2] @ along, self._from_centre[:, :2] @ [-along[1], along[0]]
        ahead, up = x * cosine - self._from_centre[:, 2] * sine, x * sine + self._from_centre[:, 2] * cosine
        flat = np.maximum(np.hypot(ahead, y), 1e-12)
        angle, cos, sin = np.arctan2(flat, up), ahead / flat, y / flat
        fade = np.clip(angle / NEAR, 0, 1)
        outward = np.stack([cos * along[0] - sin * along[1], cos * along[1] + sin * along[0]], axis=1) * fade[:, None]
        sideways = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
        modes = np.zeros((len(x), MODES, 3))
        modes[:, 0, 2], modes[:, 1, 2], modes[:, 2, 2] = 1.0, sine**2, sine * cos * fade
        modes[:, 3, :2], modes[:, 4, :2], modes[:, 5, :2] = outward, sine**2 * outward, (sine * cos)[:, None] * outward
        modes[:, 6, :2], modes[:, 7, :2] = (sine * sin)[:, None] * sideways, sine * along
        return angle, modes


def learn_dent(dent: Dent, shifts, places: np.ndarray, depths: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Coefficients (MODES, ORDERS, splines) from presses with shifts (K, 2) m each, tips (M, 2) m and depths (M,) m.

    groups: (M,) numbers of their places; how much the coefficients are held back is what tells every third place best from the others.
    """
    count = MODES * ORDERS * dent.table.shape[1]
    folds = [_Normal(count) for _ in range(FOLDS)]
    for shift, place, depth, group in zip(shifts, places, depths, groups):
        rows, target = dent.equations(shift, place, depth)
        folds[group % FOLDS].add(rows / depth, target / depth)
    whole = sum(folds, _Normal(count))
    penalty = _penalty(dent.table.shape[1]) * np.trace(whole.normal) / count

    def left_out(ridge):
        return sum(fold.misfit((whole - fold).solve(ridge * penalty)) for fold in folds)
    return whole.solve(min(RIDGES, key=left_out) * penalty).reshape(MODES, ORDERS, -1)


class _Normal:
    """Normal equations that can be added up and taken apart."""

    def __init__(self, count: int):
        self.normal, self.pull, self.square = np.zeros((count, count)), np.zeros(count), 0.0

    def add(self, rows, target):
        self.normal, self.pull, self.square = self.normal + rows.T @ rows, self.pull + rows.T @ target, self.square + target @ target

    def solve(self, penalty) -> np.ndarray:
        return np.linalg.solve(self.normal + penalty, self.pull)

    def misfit(self, x) -> float:
        return float(x @ self.normal @ x - 2 * x @ self.pull + self.square)

    def __add__(self, other: _Normal) -> _Normal:
        return self._joined(other, 1)

    def __sub__(self, other: _Normal) -> _Normal:
        return self._joined(other, -1)

    def _joined(self, other, sign):
        joined = _Normal(len(self.pull))
        joined.normal, joined.pull = self.normal + sign * other.normal, self.pull + sign * other.pull
        joined.square = self.square + sign * other.square
        return joined


def _penalty(splines: int) -> np.ndarray:
    kink = np.diff(np.eye(splines), 2, axis=0)
    small = np.kron(np.tile(ORDER_RIDGE**2, MODES), np.ones(splines))
    return np.diag(small) + ROUGH * np.kron(np.eye(MODES * ORDERS), kink.T @ kink)


def _spline_table() -> tuple[np.ndarray, float]:
    """Cubic splines over KNOTS (all zero beyond the last) at even steps of angle."""
    knots = np.concatenate([[KNOTS[0]] * 3, KNOTS, [KNOTS[-1]] * 3])
    angle = np.linspace(0, KNOTS[-1], 551)
    table = BSpline.design_matrix(np.minimum(angle, KNOTS[-1] * (1 - 1e-12)), knots, 3).toarray()[:, :-1]
    return table, float(angle[1])

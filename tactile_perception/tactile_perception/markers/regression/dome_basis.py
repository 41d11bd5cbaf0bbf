# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Basis of the displacement of a dome's surface under a round tip, learned from presses: a function of position relative to the touch.

The dome is a sphere, so a dent depends on its place only through the slope there. Vertical, outward and tangential displacement are
splines of the angle from the touch times the first harmonics of the azimuth, each with the power of the slope's sine that symmetry
requires, times a cubic in depth without constant. Apparent displacement is linear in the splines' coefficients.
"""
from __future__ import annotations

from copy import copy

import numpy as np
import scipy

from ...common.spherical_cap import Cap

KNOTS = np.array([0.0, 0.06, 0.12, 0.18, 0.25, 0.34, 0.45, 0.6, 0.8, 1.1, 1.5])  # rad from the touch. Chosen: dense where it is steep
NEAR = 0.065                      # rad: azimuthal modes fade to zero within it, where the azimuth is undefined. Chosen
ORDERS = 3                        # of depth
ORDER_RIDGE = np.array([0.2, 1.0, 3.0])  # ridge of each order. Chosen
ROUGH = 30.0                      # ridge of second differences along the splines. Chosen
SHALLOW = 0.2                     # of the deepest press: above it, model errors are in proportion to depth. Chosen
ANCHORS = np.array([0.0, 0.08, 0.16, 0.25, 0.35, 0.5, 0.7, 0.9, 1.2])  # rad from the touch, of the prior on displacement. Chosen
ANCHOR = 0.01                     # weight of that prior over that of a marker. Chosen
NEAREST = 0.1                     # least height of a point over the eye, of its untouched height. Chosen
NEARER = (0.5, 2.5)               # limits of the magnification of a point by its displacement. Chosen
UNLIKE = 3.0                      # times the median residual: presses beyond it are down-weighted as outliers. Chosen
MODES = 8
LOG_DEPTH, LOG_SHAPE = 2, 3       # parameters of a dent: x, y of the tip, m; logs of its depth and of the depth of its shape, m


class Dent:
    """rest: (K, 2) m, eye: (K, 3) m as in MarkerField; points: (K, 3) m on the dome; towards: tip radius over the distance of the
    centres of tip and dome; unit: m, of depth; coefficients: (MODES, ORDERS, splines), None before the fit.
    """

    def __init__(self, rest: np.ndarray, eye: np.ndarray, points: np.ndarray, cap: Cap, plane_z: float, towards: float, unit: float,
                 coefficients: np.ndarray | None = None):
        self.cap, self.towards, self.unit, self.coefficients = cap, towards, unit, coefficients
        self.out, self.height, self.level = rest - eye[:, :2], plane_z - eye[:, 2], points[:, 2] - eye[:, 2]
        self.place = self.out * (self.level / self.height)[:, None]
        self._from_centre = points - [0.0, 0.0, cap.centre_z]
        self.table, self.step = _spline_table()

    def appear(self, dent: np.ndarray) -> np.ndarray:
        """(K, 2) m, apparent displacement under a dent with parameters (4,)."""
        return self.seen_at(self.moved(dent))

    def seen_at(self, moved: np.ndarray) -> np.ndarray:
        """(K, 2) m, apparent displacement of points that moved by (K, 3) m, their height over the eye limited by NEAREST."""
        level = np.maximum(self.level + moved[:, 2], NEAREST * self.level)
        return (self.place + moved[:, :2]) * (self.height / level)[:, None] - self.out

    def with_coefficients(self, coefficients: np.ndarray) -> Dent:
        """The same with other coefficients."""
        other = copy(self)
        other.coefficients = coefficients
        return other

    def moved(self, dent: np.ndarray) -> np.ndarray:
        """(K, 3) m, displacement under a dent with parameters (4,)."""
        return self.powers(dent) @ self.fields(dent[:2])

    def fields(self, tip: np.ndarray) -> np.ndarray:
        """(K, ORDERS, 3) m, displacement for each power of depth under a dent at tip (2,) m."""
        angle, modes = self._modes(tip)
        size = self._splines(angle) @ self.coefficients.transpose(2, 1, 0).reshape(-1, ORDERS * MODES)
        return size.reshape(-1, ORDERS, MODES) @ modes

    def powers(self, dent: np.ndarray) -> np.ndarray:
        """(ORDERS,) powers of the depth of a dent with parameters (4,)."""
        return np.exp(dent[LOG_DEPTH]) / self.unit * (np.exp(dent[LOG_SHAPE]) / self.unit) ** np.arange(ORDERS)

    def equations(self, shift: np.ndarray, place: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
        """Rows (2 n, MODES * ORDERS * splines) and targets (2 n,), m, of the linear fit to a press with shift (K, 2) m at n markers
        seen.
        """
        angle, modes = self._modes(place)
        seen = np.isfinite(shift).all(1) & np.isfinite(angle)
        slope = (self.out + shift) / self.level[:, None]
        along = (self.height / self.level)[:, None, None] * modes[..., :2] - modes[..., 2:] * slope[:, None]
        powers = depth / self.unit * (depth / self.unit) ** np.arange(ORDERS)
        rows = np.einsum('kmc,o,ks->kcmos', along[seen], powers, self._splines(angle[seen]))
        return rows.reshape(2 * seen.sum(), -1), shift[seen].ravel()

    def anchors(self, place: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
        """Rows and targets (n,), m, of the prior: the skin goes down by depth under the tip, and by less with the log of the distance.

        One camera does not observe the scale of the dome about the eye, so markers alone leave the displacement undetermined.
        """
        angle, turn = (part.ravel() for part in np.meshgrid(ANCHORS, [0.0, np.pi / 2, np.pi]))
        along, up = _frame(place, self.towards, self.cap.curvature_radius)
        across = np.cross(up, along)
        points = np.sin(angle)[:, None] * (np.cos(turn)[:, None] * along + np.sin(turn)[:, None] * across) + np.cos(angle)[:, None] * up
        known, modes = self._modes(place, self.cap.curvature_radius * points)
        powers = depth / self.unit * (depth / self.unit) ** np.arange(ORDERS)
        down = -depth * np.log(ANCHORS[-1] / np.maximum(angle, ANCHORS[1])) / np.log(ANCHORS[-1] / ANCHORS[1])
        rows = np.einsum('kmc,o,ks->kcmos', modes, powers, self._splines(known)).reshape(3 * len(angle), -1)
        return rows, np.column_stack([np.zeros((len(angle), 2)), down]).ravel()

    def _splines(self, angle: np.ndarray) -> np.ndarray:
        position = np.clip(np.nan_to_num(angle, nan=KNOTS[-1]) / self.step, 0, len(self.table) - 1.001)
        low = position.astype(int)
        part = (position - low)[:, None]
        return self.table[low] * (1 - part) + self.table[low + 1] * part

    def _modes(self, tip: np.ndarray, points: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Angles (K,) rad from the touch and displacement (K, MODES, 3) of the modes, at points (K, 3) m from the dome's centre."""
        points = self._from_centre if points is None else points
        ahead, touch = _frame(tip, self.towards, self.cap.curvature_radius)
        sine, along = float(np.hypot(*touch[:2])), ahead[:2] / np.hypot(*ahead[:2])
        x, y, up = points @ ahead, points[:, :2] @ [-along[1], along[0]], points @ touch
        flat = np.maximum(np.hypot(x, y), 1e-12)
        angle, cos, sin = np.arctan2(flat, up), x / flat, y / flat
        fade = np.clip(angle / NEAR, 0, 1)
        outward = np.stack([cos * along[0] - sin * along[1], cos * along[1] + sin * along[0]], axis=1) * fade[:, None]
        sideways = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
        modes = np.zeros((len(x), MODES, 3))
        modes[:, 0, 2], modes[:, 1, 2], modes[:, 2, 2] = 1.0, sine**2, sine * cos * fade
        modes[:, 3, :2], modes[:, 4, :2], modes[:, 5, :2] = outward, sine**2 * outward, (sine * cos)[:, None] * outward
        modes[:, 6, :2], modes[:, 7, :2] = (sine * sin)[:, None] * sideways, sine * along
        return angle, modes


def _frame(tip: np.ndarray, towards: float, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (3,) at the touch of a tip at (2,) m on a sphere of radius, m: downhill tangent, and normal."""
    place = tip * (1 - towards)
    reach = float(np.hypot(*place))
    along = place / reach if reach > 1e-9 else np.array([1.0, 0.0])
    sine = min(reach / radius, 0.95)
    cosine = np.sqrt(1 - sine**2)
    return np.array([*(cosine * along), -sine]), np.array([*(sine * along), cosine])


class DentFit:
    """Fits dents to presses with shifts (K, 2) m each, tips (M, 2) m and depths (M,) m."""

    def __init__(self, dent: Dent, shifts, places: np.ndarray, depths: np.ndarray):
        self._dent, self._shifts, self._places, self._depths = dent, shifts, places, depths
        self._systems = [dent.equations(shift, place, depth) for shift, place, depth in zip(shifts, places, depths)]
        self._sure = 1 / np.hypot(depths, SHALLOW * depths.max())
        self._anchors = self._anchored(places, depths)
        self._first = self._normal(self._sure[:, None])
        self._penalty = _penalty(dent.table.shape[1]) * np.trace(self._first[0]) / len(self._first[1])

    def coefficients(self, ridge: float) -> np.ndarray:
        """(MODES, ORDERS, splines) of the ridge regression; ridge: relative to the data.

        A first solution gives the magnification of each point, which weights its pixels, and the outlying presses, which it down-weights.
        """
        first = self._solve(self._first, ridge)
        return self._solve(self._normal(self._weights(first)), ridge)

    def _anchored(self, places, depths) -> tuple[np.ndarray, np.ndarray]:
        square, pull = 0.0, 0.0
        for place, depth, sure in zip(places, depths, self._sure):
            rows, target = (part * (ANCHOR * sure) for part in self._dent.anchors(place, depth))
            square, pull = square + rows.T @ rows, pull + rows.T @ target
        return square, pull

    def _normal(self, weights) -> tuple[np.ndarray, np.ndarray]:
        square, pull = self._anchors
        for (rows, target), weight in zip(self._systems, weights):
            rows = rows * weight.reshape(-1, 1)
            square, pull = square + rows.T @ rows, pull + rows.T @ (target * weight)
        return square, pull

    def _solve(self, normal, ridge: float) -> np.ndarray:
        return np.linalg.solve(normal[0] + ridge * self._penalty, normal[1]).reshape(MODES, ORDERS, -1)

    def _weights(self, coefficients: np.ndarray) -> list[np.ndarray]:
        """Weights of the equations of each press."""
        dent = self._dent.with_coefficients(coefficients)
        nearer, off = [], []
        for shift, place, depth in zip(self._shifts, self._places, self._depths):
            moved = dent.moved(np.array([*place, np.log(depth), np.log(depth)]))
            seen = np.isfinite(shift).all(1)
            nearer.append(np.repeat(np.clip(dent.level / (dent.level + moved[:, 2]), *NEARER)[seen], 2))
            off.append(np.sqrt(np.mean((dent.seen_at(moved) - shift)[seen]**2)))
        off = np.array(off) * self._sure
        alike = 1 / np.maximum(1, (off / (UNLIKE * np.median(off)))**2)
        return [share * near for share, near in zip(self._sure * alike, nearer)]


def _penalty(splines: int) -> np.ndarray:
    kink = np.diff(np.eye(splines), 2, axis=0)
    small = np.kron(np.tile(ORDER_RIDGE**2, MODES), np.ones(splines))
    return np.diag(small) + ROUGH * np.kron(np.eye(MODES * ORDERS), kink.T @ kink)


def _spline_table() -> tuple[np.ndarray, float]:
    """Cubic B-splines on KNOTS (zero beyond the last), tabulated at even steps of angle; that step, rad."""
    knots = np.concatenate([[KNOTS[0]] * 3, KNOTS, [KNOTS[-1]] * 3])
    angle = np.linspace(0, KNOTS[-1], 551)
    table = scipy.interpolate.BSpline.design_matrix(np.minimum(angle, KNOTS[-1] * (1 - 1e-12)), knots, 3).toarray()[:, :-1]
    return table, float(angle[1])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Registration of a contact's image with a keyframe: a robust fit of rigid motion and growth to the normal flow of its edges.

Gauss-Newton on intensity residuals (Lucas and Kanade). Growth along the edges' normals is fitted too, since a change of load makes a
contact grow or shrink without motion.
"""
from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.linalg.lapack import dposv
from scipy.ndimage import map_coordinates

from ..common.statistics import SIGMA_PER_MAD, upper_median

_EDGE = 0.08  # gradient of a score, 1/taxel, from which a taxel belongs to an edge. Chosen
_FEWEST, _MOST = 6, 250  # edge taxels: needed (4 unknowns), and used at most (bounds the time). Chosen
_ITERATIONS = 4
_CONVERGED = 0.04  # taxels: a step below it leaves an error of about a tenth of it
_TUKEY = 4.685  # of the biweight: 95 percent efficiency for Gaussian noise
_MIN_SIGMA = 0.015  # least standard deviation of the score's residuals. Chosen
# Least information on a shift, relative to the best direction, and on a rotation: a face of 3 : 2 has 0.06, a ring has only that of its
# roughness, which is larger where edges are few (plus _ROUGHNESS over their number).
_MIN_SHIFT_INFORMATION, _MIN_TURN_INFORMATION, _ROUGHNESS = 0.02, 0.035, 3.0
_REACH_QUANTILE = 0.9  # of the edges' distances, is the reach: a few edges beside the contact must not count. Chosen
_LARGE = 20  # taxels, from which two at the array's border are ignored, else one. Chosen
_CENTROID_SIGMA = 0.3  # taxels, standard deviation of the centroid of a contact of few taxels: pressure shifts without motion. Chosen
_FAR = 5.0  # taxels, largest motion since a keyframe. Chosen: farther the fit does not converge
# The fit holds if the standard deviation of its residuals is below the first, and the part of inliers above the second. Chosen.
_MAX_SIGMA, _MIN_INLIERS = 0.2, 0.7
# An image is the sum of a cubic B-spline at each taxel times its score: values and slopes at the taxels.
_SPLINE, _SLOPE = np.float32([1 / 6, 2 / 3, 1 / 6]), np.float32([-0.5, 0, 0.5])


@dataclass(frozen=True)
class KeyframeMotion:
    """Motion since the keyframe: a point p (column, row, taxels) of the contact moves to middle + R(turn) (p - middle) + shift.

    fit: (4,) taxels, shift along columns and rows, turn times reach, growth along the edges' normals; turn: rad, NaN where unobservable;
    spread: standard deviation of the score's residuals; reach: distance of far edges from middle, taxels; sigma: standard deviation of the
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
        return math.hypot(*self.shift) + abs(self.known_turn) * self.reach


class Keyframe:
    """An image that later ones are registered with. score: (rows, columns) float32."""

    def __init__(self, score: np.ndarray):
        gx = cv2.sepFilter2D(score, -1, _SLOPE, _SPLINE, borderType=cv2.BORDER_REPLICATE)
        gy = cv2.sepFilter2D(score, -1, _SPLINE, _SLOPE, borderType=cv2.BORDER_REPLICATE)
        steep = np.sqrt(gx * gx + gy * gy)  # cv2.magnitude rounds by where the arrays lie in memory
        # What moves over the array's border is not seen: ignore it.
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
        far = round(_REACH_QUANTILE * (len(rows) - 1))
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

    def motion(self, score: np.ndarray, start: np.ndarray | None = None) -> KeyframeMotion | None:
        """The motion from the keyframe to score (rows, columns) float32; start: predicted fit (4,). None where the fit fails."""
        if self._used is None:
            return None
        guess = np.zeros(4) if start is None else start.copy()
        for _ in range(_ITERATIONS):
            left = self._value - self._sampled(score, guess)
            size = np.abs(left)
            spread = max(SIGMA_PER_MAD * upper_median(size), _MIN_SIGMA)
            step = self._step(left, spread)
            guess[self._used] += step
            if np.abs(step).max() < _CONVERGED:
                break
        if not np.isfinite(guess).all() or math.hypot(*guess[:2]) + abs(guess[2]) > _FAR or spread > _MAX_SIGMA or \
                np.count_nonzero(size < _TUKEY * spread) < _MIN_INLIERS * len(size):
            return None
        turn = guess[2] / self.reach if 2 in self._used else np.nan
        return KeyframeMotion(guess, float(turn), spread, self.middle, self.reach, spread * self._position_sigma)

    def _determined(self, slopes: np.ndarray) -> list[int] | None:
        """The columns of slopes (M, 4) that the edges determine; None where a shift is unobservable."""
        normal = slopes.T @ slopes
        xx, xy, yy = normal[0, 0], normal[0, 1], normal[1, 1]
        total, apart = xx + yy, math.hypot(xx - yy, 2 * xy)
        if total - apart < _MIN_SHIFT_INFORMATION * (total + apart):
            return None
        x, y = normal[2, :2]
        turning = normal[2, 2] - (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        used = [0, 1, 2, 3] if turning > (_MIN_TURN_INFORMATION + _ROUGHNESS / len(slopes)) * total else [0, 1, 3]
        covariance = np.linalg.pinv(normal[used][:, used], hermitian=True)[:-1, :-1]
        self._position_sigma = math.sqrt(np.linalg.eigvalsh(covariance)[-1])
        return used

    def _sampled(self, score: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """score at the keyframe's edges moved by guess (4,); growth enters linearly."""
        place = self._place + guess[1::-1, None]
        if guess[2]:
            cosine, sine = math.cos(guess[2] / self.reach) - 1, math.sin(guess[2] / self.reach)
            place += np.array([[cosine, sine], [-sine, cosine]]) @ self._arm
        return map_coordinates(score, place, np.float64, order=3, mode='nearest', prefilter=False) + self._growth * guess[3]

    def _step(self, left: np.ndarray, spread: float) -> np.ndarray:
        """Gauss-Newton step of the used columns from residuals (M,), weighted by Tukey's biweight."""
        weight = left * (1 / (_TUKEY * spread))
        weight = np.maximum(1 - weight * weight, 0)
        weight *= weight
        weighed = self._slopes.T * weight
        normal = weighed @ self._slopes
        diagonal = normal.ravel()[::len(normal) + 1]
        diagonal += 1e-9 * diagonal.sum() + 1e-12
        return dposv(normal, weighed @ left)[1]


class KeyCentroid:
    """Keyframe of a contact of few taxels, registered by the centroid of pressure (rows, columns) in touched (rows, columns) bool."""

    def __init__(self, pressure: np.ndarray, touched: np.ndarray):
        self.middle, self.reach = _centroid(pressure, touched), 1.0

    def motion(self, pressure: np.ndarray, touched: np.ndarray) -> KeyframeMotion | None:
        """The motion from the keyframe to pressure (rows, columns) where touched; None for a jump."""
        shift = _centroid(pressure, touched) - self.middle
        if not np.hypot(*shift) < _FAR:
            return None
        return KeyframeMotion(np.array([*shift, 0.0, 0.0]), np.nan, _MIN_SIGMA, self.middle, self.reach, _CENTROID_SIGMA)


def _centroid(pressure: np.ndarray, touched: np.ndarray) -> np.ndarray:
    row, column = np.nonzero(touched)
    weight = np.maximum(pressure[row, column], 0) + 1e-12
    return np.array([weight @ column, weight @ row]) / weight.sum()

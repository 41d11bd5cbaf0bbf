# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reference positions of untouched dots: averaged over the first frames, tracked as they drift, frozen during contact."""
from __future__ import annotations

import math

import numpy as np

from tactile_perception.dots.reference.calibrated_rest import CalibratedRest
from tactile_perception.dots.reference.release import Release
from tactile_perception.dots.reference.untouched_shape import rest_suspicion
from tactile_perception.errors import BadArgument

QUIET = 5.0  # standard deviations from the common affine motion, beyond which a dot is displaced by contact. Chosen
QUIET_FLOOR = 0.1  # px, least such deviation: changes of light shift centroids by less. Chosen
DRIFTED = 0.5  # px, median displacement that is contact: drift is tracked before it grows so far. Chosen
QUIET_SHARE = 0.01  # of the dots, that may deviate as outliers. Chosen
AFFINE_SHARE = 0.8  # of the dots, those with the least residuals, that the second affine fit uses. Chosen


class Reference:
    """Untouched positions of indexed dots, px.

    time_constant_s: of drift; frames: number of untouched frames that are averaged first; known: calibrated positions, used while a sensor
    that starts under contact is not released; suspicious: why the reference may not be untouched, ''. A dot that appears later gets its
    position in the next untouched frame. Raises BadArgument for a time constant that is not positive or frames below 1.
    """

    def __init__(self, time_constant_s: float = 30.0, frames: int = 10, known: CalibratedRest | None = None):
        if not (time_constant_s > 0 and frames >= 1):
            raise BadArgument(f'time_constant_s > 0 and frames >= 1 are needed, not {time_constant_s} and {frames}')
        self._time_constant_s, self._frames, self._known = time_constant_s, frames, known
        self.restart()

    def restart(self) -> None:
        """Take the next frame as the reference."""
        self.id = np.zeros(0, np.int64)
        self.uv = np.zeros((0, 2))
        self._count = np.zeros(0)
        self._stamp_s = None
        self._release = Release()
        self.touched = False
        self.suspicious, self._doubted = '', False

    def update(self, id: np.ndarray, uv: np.ndarray, sigma: np.ndarray, stamp_s: float, columns: int,
               touched: bool | None = None) -> np.ndarray:
        """Displacements (N, 2) px of dots id (N,) at uv (N, 2) with standard deviations sigma (N,) px; NaN without a reference position.

        touched: as known by a later stage, None to decide by the dots; columns: of the grid, 0 for other patterns. Dots with a non-finite
        position count as not seen.
        """
        seen = np.isfinite(uv).all(axis=1)
        if seen.all():
            return self._update(id, uv, sigma, stamp_s, columns, touched)
        duv = np.full(uv.shape, np.nan)
        duv[seen] = self._update(id[seen], uv[seen], sigma[seen], stamp_s, columns, touched)
        return duv

    def _update(self, id, uv, sigma, stamp_s, columns, touched) -> np.ndarray:
        if not len(self.id) or self._doubted and not self._known.judge(id, uv).pressed:
            self.restart()
            self._begin(id, uv, columns)
        rest = self.places(id)
        self.touched = self._is_touched(id, uv, uv - rest, sigma, stamp_s) if touched is None else bool(touched)
        if not self.touched:
            self._follow(id, uv, rest, stamp_s)
            rest = self.places(id)
        self._stamp_s = stamp_s
        return uv - rest

    def places(self, id: np.ndarray) -> np.ndarray:
        """Reference positions (N, 2) px of dots id (N,), NaN where unknown."""
        if np.array_equal(id, self.id):
            return self.uv.copy()
        at, known = self._index(id)
        return np.where(known[:, None], self.uv[at], np.nan)

    def _index(self, id: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        at = np.minimum(np.searchsorted(self.id, id), len(self.id) - 1)
        return at, self.id[at] == id

    def _begin(self, id: np.ndarray, uv: np.ndarray, columns: int) -> None:
        if self._known is None:
            self._insert(id, uv)
            self.suspicious = rest_suspicion(id, uv, columns) if columns else ''
            return
        judgement = self._known.judge(id, uv)
        self.suspicious, self._doubted = judgement.reason, judgement.pressed
        if judgement.pressed and judgement.known:
            id = np.flatnonzero(np.isfinite(self._known.uv).all(axis=1))
            uv = self._known.uv[id]
        self._insert(id, uv)

    def _insert(self, id: np.ndarray, uv: np.ndarray) -> None:
        order = np.argsort(np.r_[self.id, id], kind='stable')
        self.id = np.r_[self.id, id][order]
        self.uv = np.vstack([self.uv, uv])[order]
        self._count = np.r_[self._count, np.zeros(len(id))][order]

    def _follow(self, id: np.ndarray, uv: np.ndarray, rest: np.ndarray, stamp_s: float) -> None:
        """Average over the first frames, then track with the time constant."""
        known = np.isfinite(rest[:, 0])
        at = self._index(id[known])[0]
        elapsed = 0.0 if self._stamp_s is None else max(0.0, stamp_s - self._stamp_s)
        slow = np.minimum(1.0, elapsed / self._time_constant_s)
        gain = np.where(self._count[at] < self._frames, 1 / (self._count[at] + 1), slow)
        self.uv[at] += gain[:, None] * (uv[known] - self.uv[at])
        self._count[at] += 1
        if not known.all():
            self._insert(id[~known], uv[~known])

    def _is_touched(self, id, uv, duv, sigma, stamp_s) -> bool:
        """Whether something touches; the residual displacement after a contact is tracked as drift."""
        moved, size = self._moved(uv, duv, sigma)
        if not moved:
            self._release.forget()
            return False
        return not self._release.is_residue(size, id, uv, sigma, stamp_s)

    def _moved(self, uv, duv, sigma) -> tuple[bool, float]:
        """Whether more dots than outliers deviate from the common affine motion (as drift moves all), and the largest deviation, px,
        without outliers."""
        known = np.isfinite(duv[:, 0])
        if not known.all():
            uv, duv, sigma = uv[known], duv[known], sigma[known]
        count = len(uv)
        if not count:
            return False, 0.0
        shared = math.sqrt(_smallest(np.einsum('ij,ij->i', duv, duv), count // 2))
        if count < 8:
            return shared > DRIFTED, shared
        places = np.empty((4, count))
        places[:2], places[2:] = uv.T, duv.T
        square = _off_affine(places, places)
        square = _off_affine(places, places.compress(square <= _smallest(square, int(AFFINE_SHARE * count)), axis=1))
        size = math.sqrt(_smallest(square, int((1 - QUIET_SHARE) * (count - 1))))
        leaves = np.count_nonzero(np.sqrt(square) > np.maximum(QUIET * sigma, QUIET_FLOOR)) > QUIET_SHARE * count
        return bool(leaves or shared > DRIFTED), max(size, shared)


def _smallest(values: np.ndarray, at: int) -> float:
    """The element of values (N,) at this index of their sorted order."""
    return float(np.partition(values, at)[at])


def _off_affine(places: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Squared residuals (N,) px^2 of the affine motion fitted to kept; places, kept: (4, ...) u, v and their displacements, px."""
    middle = kept.sum(axis=1, keepdims=True) / kept.shape[1]
    kept = kept - middle
    products = kept @ kept.T
    a, b, d = products[0, 0], products[0, 1], products[1, 1]
    ridge = 1e-9 * (a + d) + 1e-9  # for collinear dots
    a, d = a + ridge, d + ridge
    less = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    less[:, :2] = products[2:, :2] @ np.array([[-d, b], [b, -a]]) / (a * d - b * b)
    off = less @ (places - middle)
    off *= off
    return off[0] + off[1]

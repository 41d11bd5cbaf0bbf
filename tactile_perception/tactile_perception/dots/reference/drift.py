# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the dots are while nothing touches: taken from the first frames, following slow drift, frozen while something touches."""
from __future__ import annotations

import math

import numpy as np

from tactile_perception.dots.reference.calibrated_rest import KnownRest
from tactile_perception.dots.reference.release import Release
from tactile_perception.dots.reference.untouched_shape import rest_suspicion
from tactile_perception.errors import BadArgument

QUIET = 5.0  # standard deviations: a dot that leaves the common affine motion by more is being moved by something that touches
QUIET_FLOOR = 0.1  # px: what small changes of light do to a dot's centroid is no touch
DRIFTED = 0.5  # px: dots that have, most of them, left the reference further have been moved; drift is followed before it gets there
QUIET_SHARE = 0.01  # of the dots may be off by more, as false ones are


class Reference:
    """Untouched places of numbered dots, px.

    time_constant_s: how fast slow drift is followed. frames: the first so many untouched frames are averaged evenly. A dot seen
    first later on gets its place when it is seen in an untouched frame. known: calibrated places, which take the place of the first ones
    where those are of a touched sensor; once it is released, places are taken as at first. suspicious: why the places may not be
    untouched ones, in words.
    """

    def __init__(self, time_constant_s: float = 30.0, frames: int = 10, known: KnownRest | None = None):
        if not (time_constant_s > 0 and frames >= 1):
            raise BadArgument(f'time_constant_s > 0 and frames >= 1 are needed, not {time_constant_s} and {frames}')
        self._time_constant_s, self._frames, self._known = time_constant_s, frames, known
        self.restart()

    def restart(self) -> None:
        """The next frame is the new reference."""
        self.id = np.zeros(0, np.int64)
        self.uv = np.zeros((0, 2))
        self._count = np.zeros(0)
        self._stamp_s = None
        self._release = Release()
        self.touched = False
        self.suspicious, self._doubted = '', False

    def update(self, id: np.ndarray, uv: np.ndarray, sigma: np.ndarray, stamp_s: float, columns: int,
               touched: bool | None = None) -> np.ndarray:
        """Displacements (N, 2) px of dots id (N,) at uv (N, 2) with standard deviations sigma (N,) px; NaN for a dot without a rest place.

        touched: what a later stage knows; None leaves it to the dots themselves. columns: of the grid, 0 for other patterns. A dot whose
        place is no number counts as not seen.
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
        """(N, 2) rest places of dots id (N,), NaN where not known."""
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
        """The places go towards the dots: evenly over the first frames, then with the time constant."""
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
        """Whether something touches; what a touch has left when it ended is followed as slow drift is."""
        moved, size = self._moved(uv, duv, sigma)
        if not moved:
            self._release.forget()
            return False
        return not self._release.is_residue(size, id, uv, sigma, stamp_s)

    def _moved(self, uv, duv, sigma) -> tuple[bool, float]:
        """Whether more than stray dots leave the motion that all share (drift shifts, turns and swells the whole image), and how far (px)
        those few do that do most."""
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
        square = _off_affine(places, places.compress(square <= _smallest(square, int(0.8 * count)), axis=1))
        size = math.sqrt(_smallest(square, int((1 - QUIET_SHARE) * (count - 1))))
        leaves = np.count_nonzero(np.sqrt(square) > np.maximum(QUIET * sigma, QUIET_FLOOR)) > QUIET_SHARE * count
        return bool(leaves or shared > DRIFTED), max(size, shared)


def _smallest(values: np.ndarray, at: int) -> float:
    """The value that as many (at) of values (N,) come before."""
    return float(np.partition(values, at)[at])


def _off_affine(places: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """(N,) px^2, squares of how far dots leave the common affine motion of those kept; both (4, ...): u, v and displacements along them,
    px."""
    middle = kept.sum(axis=1, keepdims=True) / kept.shape[1]
    kept = kept - middle
    products = kept @ kept.T
    a, b, d = products[0, 0], products[0, 1], products[1, 1]
    ridge = 1e-9 * (a + d) + 1e-9  # dots on one line say nothing of the motion's change across it
    a, d = a + ridge, d + ridge
    less = np.array([[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    less[:, :2] = products[2:, :2] @ np.array([[-d, b], [b, -a]]) / (a * d - b * b)
    off = less @ (places - middle)
    off *= off
    return off[0] + off[1]

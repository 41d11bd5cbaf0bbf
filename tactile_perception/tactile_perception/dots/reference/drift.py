# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reference positions of untouched dots: averaged over the first frames, tracked as they drift, frozen during contact."""
from __future__ import annotations

import numpy as np

from tactile_perception._core import all_within, deviation_from_drift, follow_drift, reference_places
from tactile_perception.dots.reference.calibrated_rest import CalibratedRest
from tactile_perception.dots.reference.release import Release
from tactile_perception.dots.reference.untouched_shape import rest_suspicion
from tactile_perception.errors import BadArgument

CALIBRATED = 10  # untouched frames: weight of calibrated positions where the camera has not moved since. Chosen: as the usual `frames`


class Reference:
    """Untouched positions of indexed dots, px.

    time_constant_s: of drift; frames: number of untouched frames that are averaged first; known: calibrated positions, used while a sensor
    that starts under contact is not released, and averaged in as CALIBRATED frames where the first dots are at them; suspicious: why the
    reference may not be untouched, ''. A dot that appears later gets its position in the next untouched frame. Raises BadArgument for a
    time constant that is not positive or frames below 1.
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
        self._count, self._calibrated = np.zeros(0, np.int64), 0
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
        id, uv, sigma = np.asarray(id, np.int64), np.asarray(uv, float), np.asarray(sigma, float)
        if all_within(uv):
            return self._update(id, uv, sigma, stamp_s, columns, touched)
        seen, duv = np.isfinite(uv).all(axis=1), np.full(uv.shape, np.nan)
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
        return reference_places(id, self.id, self.uv)

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
        if judgement.stayed:
            calibrated = self._known.places(self.id)
            at = np.isfinite(calibrated).all(axis=1)
            self.uv[at], self._count[at], self._calibrated = calibrated[at], CALIBRATED, CALIBRATED

    def _insert(self, id: np.ndarray, uv: np.ndarray) -> None:
        order = np.argsort(np.r_[self.id, id], kind='stable')
        self.id = np.r_[self.id, id][order]
        self.uv = np.vstack([self.uv, uv])[order]
        self._count = np.r_[self._count, np.zeros(len(id), np.int64)][order]

    def _follow(self, id: np.ndarray, uv: np.ndarray, rest: np.ndarray, stamp_s: float) -> None:
        """Average over the first frames, then track with the time constant."""
        elapsed = 0.0 if self._stamp_s is None else max(0.0, stamp_s - self._stamp_s)
        slow = min(1.0, elapsed / self._time_constant_s)
        self.uv, self._count = follow_drift(id, uv, self.id, self.uv, self._count, frames=self._calibrated + self._frames,
                                            slow=slow)
        new = np.isnan(rest[:, 0])
        if new.any():
            self._insert(id[new], uv[new])
            self._judge_anew()

    def _judge_anew(self) -> None:
        """Begin anew where the reference with the dots that have been added does not show an untouched sensor."""
        id, uv = self.id, self.uv
        if self._known is not None and self._known.judge(id, uv).pressed:
            self.restart()
            self._begin(id, uv, columns=0)

    def _is_touched(self, id, uv, duv, sigma, stamp_s) -> bool:
        """Whether something touches; the residual displacement after a contact is tracked as drift."""
        moved, size = deviation_from_drift(uv, duv, sigma)
        if not moved:
            self._release.forget()
            return False
        return not self._release.is_residue(size, id, uv, sigma, stamp_s)

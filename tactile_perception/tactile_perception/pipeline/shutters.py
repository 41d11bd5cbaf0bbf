# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Brings markers that the right one of two cameras saw to the exposure of the left one."""
from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from tactile_driver.stitching.calibration import Stitching

from ..common.surface import scatter
from ..common.dots import DotTracks
from ..markers.places.seam import SeamBalance
from ..markers.view.sensor import MarkerSensor

# Where motion begins or ends at any moment of an interval, its share in a part f of it varies by f (1 - f) at most. The standard deviation
# of the ratio is taken as so many times the root of that, and as a tenth of it where speed is steady; chosen.
_UNEVEN, _STEADIEST = 2.0, 0.1
_ALONG = 0.8  # least squared correlation of a motion and a field where a press goes deeper or back: 1 for a press, 0 for a drag; chosen
_BEGUN = 0.8  # growth of the left field since the exposure before, of itself, from which a touch has just begun; chosen
_SLOW = 0.2  # speed over that of the other view, below which a view counts as at rest; chosen
_LEAST = 0.1  # offset over interval: with less, views differ by less than one number tells of a press that moves; chosen
_FARTHEST = 3.0  # last motions by which a marker is moved on; chosen
_TORN = 0.06  # imbalance at the seam of a touch that one view does not show: 0.12 to 0.5, of others at most 0.02 (simulated)
_BEGINS, _TRACES = 0.5, 0.5  # change of the left speed, and moved right markers over left ones: first traces of a touch; chosen
_CLEAR = 0.9  # share of a motion that is not noise from which it counts as clear; noise of 100 markers reaches it once in 200 frames


class _View:
    """The last places of the markers that one camera sees; count: K, of markers."""

    def __init__(self, count: int):
        self._uv, self._sigma, self._area = np.full((count, 2), np.nan), np.full(count, np.nan), np.full(count, np.nan)
        self._time_s, self._speed = np.full(count, np.nan), 0.0

    def take(self, seen: DotTracks, time_s: float) -> _Motion:
        """The motion of markers that are seen at time_s, s, since they were seen before."""
        id, uv = seen.id, seen.uv
        move = np.where(np.isfinite(self._uv[id]), uv - self._uv[id], 0.0)
        elapsed = time_s - self._time_s[id]
        with np.errstate(divide='ignore', invalid='ignore'):
            share = 1 - 2 * (seen.sigma**2 + self._sigma[id]**2) / (move**2).sum(axis=1)
            growth = seen.area / self._area[id]
        rate = np.divide(move, elapsed[:, None], out=np.zeros_like(move), where=elapsed[:, None] > 0)
        along, field, way = (float((one * other).sum()) for one, other in ((rate, seen.duv), (seen.duv, seen.duv), (rate, rate)))
        speed = float(np.sqrt(way))
        change = abs(speed - self._speed) / max(speed + self._speed, 1e-9)
        self._uv[id], self._sigma[id], self._area[id], self._time_s[id], self._speed = uv, seen.sigma, seen.area, time_s, speed
        return _Motion(move, np.where(share > 0, share, 0.0), np.where(np.isfinite(growth), growth, 1.0), elapsed, change,
                       along / max(field, 1e-9), along**2 > _ALONG * field * way, speed)


class _Motion(NamedTuple):
    """Motion of the N markers of a view between two exposures.

    move: (N, 2) px, 0 if unknown; share: (N,) of it that is not noise; growth: (N,) ratio of areas, 1 if unknown; elapsed: (N,) s, NaN if
    unknown; change: of the speed since the motion before, 0 (steady) to 1 (begins or ends); deeper: 1/s, speed over displacement of a press
    that goes deeper (> 0) or back (< 0); straight: whether it is such a press; speed: px/s, root of the sum of squares.
    """

    move: np.ndarray
    share: np.ndarray
    growth: np.ndarray
    elapsed: np.ndarray
    change: float
    deeper: float
    straight: bool
    speed: float

    @property
    def is_clear(self) -> bool:
        """Whether it is more than noise."""
        return bool((self.share > _CLEAR).any())

    def rests_beside(self, other: _Motion) -> bool:
        """Whether it is noise, or slow beside another view's motion."""
        return not self.is_clear or self.speed < _SLOW * other.speed


def _further(left: _Motion, right: _Motion, lead_s: float) -> float:
    """By which share of its displacement a press goes on in the right view; NaN where unknown.

    lead_s: s, from the right exposure to the left one. Both views show one press in the time that their intervals share, and the right one
    moves evenly in its own.
    """
    alike = right.straight and right.deeper * left.deeper > 0
    if not (left.is_clear and left.straight) or not (alike or right.rests_beside(left)):
        return np.nan
    interval = float(np.nanmedian(left.elapsed))
    shared = interval - abs(lead_s)
    seen, known = (interval, shared) if lead_s > 0 else (shared, interval)
    grown = left.deeper * seen
    told = abs(lead_s) > _LEAST * interval and shared > 0 and grown < _BEGUN
    return (grown - right.deeper * known) / (1 - grown) if told else np.nan


def _moved(tracks: DotTracks, which: np.ndarray, move: np.ndarray, ratio: np.ndarray, growth: np.ndarray) -> DotTracks:
    """Tracks of which those (N of them) move on by a ratio (N,) of move (N, 2) px, and of their growth (N,)."""
    moved = replace(tracks, uv=tracks.uv.copy(), duv=tracks.duv.copy(), area=tracks.area.copy(), sigma=tracks.sigma.copy())
    moved.uv[which] += ratio[:, None] * move
    moved.duv[which] += ratio[:, None] * move
    moved.area[which] *= growth**ratio
    moved.sigma[which] *= np.hypot(1 + ratio, ratio)
    return moved


class RightShutter:
    """Moves the markers of the right view by their own motion between the last two right exposures, frame by frame.

    seam: px, columns of the stitched image beyond it come from the right camera; count: K, of markers; balance: None for steady motion.
    Steady motion goes on by the ratio of the two intervals, a press by what the left view saw in its interval and the right one did not in
    the part that both share. Where speed changes, as when a press begins or ends, the balance of the sheet at the seam tells the ratio
    too; both are weighted by their variances.
    A motion m of a marker is known with noise of variance n = 2 (sigma^2 + sigma_before^2), summed over both axes. The part 1 - n / |m|^2
    of it counts, none below 0 (positive-part shrinkage after James and Stein 1961): so markers at rest stay where they are seen. A marker
    without an earlier place in the right view stays too, and so does an untouched sheet. Where a touch begins or ends between the two
    exposures, so that the right view tells nothing of the left exposure, its markers are left out of this frame.
    """

    def __init__(self, seam: float, count: int, balance: SeamBalance | None = None):
        self._seam, self._count, self._balance = seam, count, balance
        self._views = _View(count), _View(count)

    def is_in(self, image: np.ndarray) -> bool:
        """Whether a stitched image (H, W, ...) shows both views; the half of a view that is missing is black."""
        seam = round(self._seam)
        return bool(image[:, :seam].any() and image[:, seam + 1:].any())

    def process(self, tracks: DotTracks, stamp_s: float, skew_s: float) -> DotTracks:
        """The tracks at the left exposure. tracks: of the stitched image; stamp_s: left exposure, s; skew_s: from it to the right one, s,
        negative where the right one is earlier; 0 leaves the tracks as they are."""
        is_right = tracks.uv[:, 0] > self._seam
        left = self._views[0].take(tracks.take(~is_right), stamp_s)
        right = self._views[1].take(tracks.take(is_right), stamp_s + skew_s)
        clear = (tracks.duv**2).sum(axis=1) > 2 * tracks.sigma**2 / (1 - _CLEAR)
        if not skew_s or not clear.any():
            return tracks
        if self._is_of_another_state(tracks, clear[~is_right].sum(), clear[is_right].sum(), skew_s, left.change):
            return tracks.take(~is_right)
        further = _further(left, right, -skew_s)
        if np.isfinite(further) and right.rests_beside(left):
            ratio = np.full(is_right.sum(), np.clip(further, -1.0, 0.0))
            return _moved(tracks, is_right, tracks.duv[is_right], ratio, right.growth)
        if not (right.share > 0).any():
            return tracks
        steady = np.where(right.share > 0, np.clip(-skew_s / right.elapsed, -1.0, _FARTHEST), 0.0)
        usual = float(np.median(steady[right.share > 0]))
        expected = further / (right.deeper * -skew_s) * usual if np.isfinite(further) else usual
        told = self._told(tracks, is_right, right.move, usual, expected, max(left.change, right.change)) if right.is_clear else usual
        return _moved(tracks, is_right, right.move, right.share * steady * (told / usual), right.growth)

    def _told(self, tracks: DotTracks, is_right: np.ndarray, move: np.ndarray, steady: float, expected: float, change: float) -> float:
        """By which multiple of its last motion move the right view goes on (> 0) or back (< 0); steady: the same of steady motion;
        expected: from both views' motions; change: of the speed."""
        least, most = (-1.0, 0.0) if steady < 0 else (0.0, _FARTHEST)
        expected = float(np.clip(expected, least, most))
        if self._balance is None:
            return expected
        whole = np.zeros((self._count, 2))
        whole[tracks.id[is_right]] = move
        found, sigma = self._balance.ratio(*self._everywhere(tracks), whole)
        if not np.isfinite(found):
            return expected
        part = min(abs(steady), 0.5)
        weight = 1 / (1 + (sigma / (_UNEVEN * max(change, _STEADIEST) * np.sqrt(part * (1 - part))))**2)
        return float(np.clip(expected + weight * (found - expected), least, most))

    def _is_of_another_state(self, tracks: DotTracks, left: int, right: int, skew_s: float, change: float) -> bool:
        """Whether only one exposure shows a touch, by how many moved markers the two views show (left, right) and the balance of the sheet:
        the right one, or the left one after an earlier right one, which may show its first traces; change: of the left view's speed. Before
        a later right one the motion of the release goes back."""
        if self._balance is None or (left and skew_s > 0):
            return False
        begins = change > _BEGINS and right < _TRACES * left
        return (bool(left) != bool(right) or begins) and self._balance.imbalance(*self._everywhere(tracks)) > _TORN

    def _everywhere(self, tracks: DotTracks) -> tuple[np.ndarray, np.ndarray]:
        """Positions and displacements (K, 2), px, of all markers, NaN for those not seen."""
        return scatter(tracks.uv, tracks.id, self._count), scatter(tracks.duv, tracks.id, self._count)


def right_shutter(stitching: Stitching | None, sensor: MarkerSensor) -> RightShutter | None:
    """For the picture of two cameras with that stitching; None for one camera. Without known places of the cameras motion counts as
    steady."""
    if stitching is None:
        return None
    known = np.isfinite(stitching.eyes).all()
    return RightShutter(stitching.seam, sensor.rows * sensor.columns, SeamBalance(stitching, sensor) if known else None)

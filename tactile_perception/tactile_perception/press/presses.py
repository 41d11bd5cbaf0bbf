# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses with ground truth, to which methods are fitted, and their errors at held-out presses."""
from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..calibration.residuals import Residuals
from ..common.marker_sensor import MarkerSensor
from ..errors import BadArgument, BadCalibration
from .estimate import TouchEstimate, TouchMethod
from .field import MarkerField

SAME_PLACE = 1e-3  # m: presses nearer than this are at one place; a stage repeats to less. Chosen
_STRAIGHT = 2e-4   # m: largest sideways travel since first contact of a straight press. Chosen
_APART = 5e-3      # m: a larger step between two frames means a new press, not a drag. Chosen
_HELD = 5e-5       # m: a stage that holds a depth varies by less. Chosen
_LIFTED = 0.6      # a depth below this share of the last depth means a new press, too. Chosen


@dataclass(frozen=True)
class Presses:
    """M frames with the ground truth of the stage that pressed.

    fields: M MarkerFields; position: (M, 3) m, the tip, NaN without contact; depth: (M,) m, 0 without contact; segment: (M,)
    int, number of the press, by default one each; wrench: (M, 6) N and N m, NaN where unknown, by default everywhere; plate: of a plate
    pressed onto all markers, which is no tip, None without one. Raises BadArgument where lengths differ.
    """

    fields: tuple[MarkerField, ...]
    position: np.ndarray
    depth: np.ndarray
    segment: np.ndarray = None
    wrench: np.ndarray = None
    plate: Presses | None = None

    def __post_init__(self):
        count = len(self.fields)
        for name, usual in (('segment', np.arange(count)), ('wrench', np.full((count, 6), np.nan))):
            if getattr(self, name) is None:
                object.__setattr__(self, name, usual)
        shapes = {'position': (count, 3), 'depth': (count,), 'segment': (count,), 'wrench': (count, 6)}
        for name, shape in shapes.items():
            if np.shape(getattr(self, name)) != shape:
                raise BadArgument(f'presses: {name} must have shape {shape}, got {np.shape(getattr(self, name))}')

    def __len__(self) -> int:
        return len(self.fields)

    @property
    def touching(self) -> np.ndarray:
        """(M,) bool: frames with contact."""
        return (self.depth > 0) & np.isfinite(self.position).all(1)

    def select(self, keep: np.ndarray) -> Presses:
        """The frames where keep, (M,) bool, or those of indices keep."""
        return Presses(tuple(self.fields[k] for k in np.arange(len(self))[keep]), self.position[keep], self.depth[keep],
                       self.segment[keep], self.wrench[keep], self.plate)

    def places(self, mirrored: bool = False) -> np.ndarray:
        """(M,) int, number of the place pressed, from 0 in order of appearance; -1 without contact. mirrored: mirror images along x and y
        share a number."""
        place, known = np.full(len(self), -1), np.zeros((0, 2))
        for k in np.flatnonzero(self.touching):
            xy = np.abs(self.position[k, :2]) if mirrored else self.position[k, :2]
            near = np.flatnonzero(np.hypot(*(known - xy).T) < SAME_PLACE)
            place[k] = near[0] if len(near) else len(known)
            known = known if len(near) else np.vstack([known, xy])
        return place

    def straight(self) -> np.ndarray:
        """(M,) bool: frames with contact in which the tool has not moved sideways since first contact."""
        straight, before, start = self.touching.copy(), -1, np.zeros(2)
        for k in np.flatnonzero(self.touching):
            xy = self.position[k, :2]
            anew = before != k - 1 or self.depth[k] < _LIFTED * self.depth[k - 1] or np.hypot(*(xy - self.position[k - 1, :2])) > _APART
            start, before = xy if anew else start, k
            straight[k] = np.hypot(*(xy - start)) <= _STRAIGHT
        return straight

    def loading(self) -> np.ndarray:
        """(M,) bool: frames with contact in which the tool is as deep as it has been in this segment."""
        loading = self.touching.copy()
        for number in np.unique(self.segment[loading]):
            mine = np.flatnonzero((self.segment == number) & self.touching)
            loading[mine] = self.depth[mine] > np.maximum.accumulate(self.depth[mine]) - _HELD
        return loading

    def some(self, places: int, depths: int) -> list[Presses]:
        """For each of up to so many places, evenly over their distances from the centre, presses at up to so many depths, rising; without
        frames of the tip's retreat, when friction has turned."""
        number, loading, away = self.places(), self.loading(), np.hypot(*self.position[:, :2].T)
        order = sorted(range(number.max() + 1), key=lambda k: away[number == k].mean())
        chosen = []
        for k in [order[i] for i in _evenly(len(order), places)]:
            mine = np.flatnonzero((number == k) & loading)
            mine = mine[np.unique(np.round(self.depth[mine], 5), return_index=True)[1]]
            chosen.append(self.select(mine[_evenly(len(mine) + 1, depths + 1)[1:] - 1]))
        return chosen

    def folds(self, count: int = 3) -> Iterator[np.ndarray]:
        """(M,) bool: frames that are held out for cross-validation by place.

        A place is held out together with its mirror images: a method that uses the sensor's symmetry would learn it from them. Untouched
        frames never are.
        """
        place = self.places(mirrored=True)
        place = place if place.max(initial=-1) > 0 else self.places()
        for fold in range(count):
            held = (place >= 0) & (place % count == fold)
            if held.any() and (self.touching & ~held).any():
                yield held


def _evenly(count: int, most: int) -> np.ndarray:
    """Up to so many of count indices, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(int))


Found = list[list[TouchEstimate] | None]  # the touches at each of M presses, None at those that are not judged


def score(found: Found, presses: Presses) -> dict[str, float]:
    """Errors over presses by name.

    place_mean, place_95, depth_mean, depth_95: mean and 95th percentile of the errors of place (x and y) and depth, m; squares: mean
    normalised squared error of place and depth (1 for a consistent covariance); place_median, depth_median: m, robust to presses too
    shallow to be located; the mean of the medians over straight presses and over drags, where there are both. NaN where no press was
    detected. presses, missed, split: number of presses, of those not detected, and of those detected as several touches.
    """
    judged, errors = _compared(found, presses)
    numbers = {'presses': len(judged), 'missed': sum(not found[k] for k in judged), 'split': sum(len(found[k]) > 1 for k in judged)}
    straight, errors = (part[np.isfinite(errors[:, 0])] for part in (presses.straight()[judged], np.abs(errors)))
    if not len(errors):
        return numbers | dict.fromkeys(('place_mean', 'place_95', 'depth_mean', 'depth_95', 'squares', 'place_median', 'depth_median'),
                                       float('nan'))
    middle = np.mean([np.median(errors[straight == down], axis=0) for down in set(straight)], axis=0)
    (place, deep, squares), (place_95, deep_95, _) = errors.mean(0).tolist(), np.percentile(errors, 95, axis=0).tolist()
    return numbers | {'place_mean': place, 'place_95': place_95, 'depth_mean': deep, 'depth_95': deep_95, 'squares': squares,
                      'place_median': float(middle[0]), 'depth_median': float(middle[1])}


def _compared(found: Found, presses: Presses) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (J,) of the presses that are judged, and of the nearest touch at each (J, 3): errors of place and of depth, m, and normalised
    squared error of the three together; NaN without one."""
    judged = np.array([k for k in np.flatnonzero(presses.touching) if found[k] is not None], int)
    errors = np.full((len(judged), 3), np.nan)
    for row, k in enumerate(judged):
        off = [(touch.position - presses.position[k])[:2] for touch in found[k]]
        if off:
            nearest = int(np.argmin(np.linalg.norm(off, axis=1)))
            off, touch = off[nearest], found[k][nearest]
            deep = touch.depth - presses.depth[k]
            squares = off @ np.linalg.solve(touch.covariance[:2, :2], off) + (deep / touch.depth_sigma)**2
            errors[row] = np.hypot(*off), deep, squares / 3
    return judged, errors


def held_out(method, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> Found:
    """What a method of methods.py finds at presses whose places are held out of its fit.

    fitted: result of fit for all presses, of which a model keeps the simulated library. Raises BadCalibration where no place can be held
    out.
    """
    found: Found = [None] * len(presses)
    for held in presses.folds():
        fresh = method.from_fitted(method.fit(presses.select(~held), sensor, fitted), sensor)
        for k in np.flatnonzero(held):
            if k == 0 or not held[k - 1]:  # of another press: what went before it is no motion
                fitted_to = copy.deepcopy(fresh)
            found[k] = fitted_to.estimate(presses.fields[k])
    if all(touches is None for touches in found):
        raise BadCalibration('all presses are at one place: none can be held out; add presses elsewhere')
    return found


def rms_errors(method: TouchMethod, presses: Presses) -> dict[str, float]:
    """RMS errors, m, of a method's place (per axis) and depth at the presses that it detects, as place_sigma and depth_sigma; NaN where it
    detects none."""
    errors = _compared([method.estimate(field) for field in presses.fields], presses)[1]
    squares = errors[np.isfinite(errors[:, 0]), :2]**2
    return dict(zip(('place_sigma', 'depth_sigma'), np.sqrt(squares.mean(0) / [2, 1]).tolist() if len(squares) else [np.nan] * 2))


_FEWEST_PLACES = 3  # chosen: cross-validation holds out one of three positions
_DEPTH_SPAN = 0.2  # chosen: smallest range of depths over the largest depth
_AXES = ('x (mm)', 'y (mm)')


def require_coverage(presses: Presses) -> None:
    """Raise BadCalibration, saying what to add, for too few positions, a single depth, or no untouched frame."""
    touching = presses.touching
    places, depth = int(presses.places().max() + 1), presses.depth[touching]
    if places < _FEWEST_PLACES:
        raise BadCalibration(f'{touching.sum()} presses at {places} positions; at least {_FEWEST_PLACES} are needed, a dozen over the '
                             'whole surface are good: add presses at other positions')
    if np.ptp(depth) < _DEPTH_SPAN * depth.max():
        raise BadCalibration(f'all presses are {depth.min() * 1e3:.2f} to {depth.max() * 1e3:.2f} mm deep: one depth does not determine '
                             'how markers move with depth; add presses of other depths, three per position are good')
    if touching.all():
        raise BadCalibration('no untouched frame among the presses; begin each recording with one second without contact')


def marker_residuals(found: Found, presses: Presses, names: Sequence[str]) -> list[Residuals]:
    """Cross-validation errors of position and depth, mm, over the surface; NaN for a press without an estimate.

    names: recording and time of each press.
    """
    judged, errors = _compared(found, presses)
    places, when = 1e3 * presses.position[judged, :2], [names[k] for k in judged]
    return [Residuals(name, 'mm', 1e3 * errors[:, column], places, _AXES, when) for column, name in enumerate(('place', 'depth'))]

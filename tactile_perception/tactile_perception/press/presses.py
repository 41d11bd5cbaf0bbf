# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses with ground truth, to which methods are fitted, and their errors at held-out presses."""
from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..calibration.residuals import Residuals
from ..errors import BadArgument, BadCalibration
from .estimate import TouchEstimate, TouchMethod
from .field import MarkerField
from .sensor import MarkerSensor

SAME_PLACE = 1e-3  # m: presses nearer than this are at one place; a stage repeats to less. Chosen
_STRAIGHT = 2e-4   # m: largest sideways travel since first contact of a straight press. Chosen
_APART = 5e-3      # m: a larger step between two frames means a new press, not a drag. Chosen
_HELD = 5e-5       # m: a stage that holds a depth varies by less. Chosen
_LIFTED = 0.6      # a depth below this share of the last depth means a new press, too. Chosen


@dataclass(frozen=True)
class Presses:
    """M frames with the ground truth of the stage that pressed.

    fields: M MarkerFields; position: (M, 3) m, the tip, NaN without contact; depth: (M,) m, 0 without contact; segment: (M,)
    int, number of the press; wrench: (M, 6) N and N m, NaN where unknown; radius: (M,) m of the tool's tip, NaN where unknown; plate: of a
    plate pressed onto all markers, which is no tip, None without one. Raises BadArgument where lengths differ.
    """

    fields: tuple[MarkerField, ...]
    position: np.ndarray
    depth: np.ndarray
    segment: np.ndarray
    wrench: np.ndarray
    radius: np.ndarray
    plate: Presses | None = None

    def __post_init__(self):
        count = len(self.fields)
        shapes = {'position': (count, 3), 'depth': (count,), 'segment': (count,), 'wrench': (count, 6), 'radius': (count,)}
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
        """The frames where keep (M,) bool."""
        return Presses(tuple(field for field, kept in zip(self.fields, keep) if kept), self.position[keep], self.depth[keep],
                       self.segment[keep], self.wrench[keep], self.radius[keep], self.plate)

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

    def held_out(self, folds: int = 3) -> Iterator[tuple[Presses, Presses]]:
        """Folds (training, held out) for cross-validation by place.

        A place is held out together with its mirror images: a method that uses the sensor's symmetry would learn it from them. Untouched
        frames are always in the training set.
        """
        place = self.places(mirrored=True)
        place = place if place.max(initial=-1) > 0 else self.places()
        for fold in range(folds):
            held = (place >= 0) & (place % folds == fold)
            if held.any() and (self.touching & ~held).any():
                yield self.select(~held), self.select(held)


@dataclass(frozen=True)
class Score:
    """Errors over presses.

    place_mean, place_95, depth_mean, depth_95: mean and 95th percentile of the errors of place (x and y) and depth, m; squares: mean
    normalised squared error of place and depth (1 for a consistent covariance); missed: presses not detected; split: presses detected as
    several touches; presses: number of presses; false: touches detected in untouched frames; place_median, depth_median: m, robust to
    presses too shallow to be located; the mean of the medians over straight presses and over drags, where there are both. NaN where no
    press was detected.
    """

    place_mean: float
    place_95: float
    depth_mean: float
    depth_95: float
    squares: float
    missed: int
    split: int
    presses: int
    false: int
    place_median: float = float('nan')
    depth_median: float = float('nan')

    def numbers(self) -> dict:
        """Name -> value."""
        return asdict(self)


def score(found: list[list[TouchEstimate]], presses: Presses, straight: np.ndarray | None = None) -> Score:
    """Errors of the touches found, one list for each press; straight: (M,) bool, presses that are no drags; None: unknown."""
    rows, missed, split, false, straight_down = [], 0, 0, 0, []
    straight = presses.touching if straight is None else straight
    for touches, position, depth, touching, down in zip(found, presses.position, presses.depth, presses.touching, straight):
        if not touching:
            false += len(touches)
        elif not touches:
            missed += 1
        else:
            split += len(touches) > 1
            rows.append(_errors(min(touches, key=lambda t: np.hypot(*(t.position - position)[:2])), position, depth))
            straight_down.append(down)
    errors = np.array(rows).reshape(-1, 3)
    if not len(errors):
        return Score(*[float('nan')] * 5, missed, split, int(presses.touching.sum()), false)
    (place, deep, squares), (place_95, deep_95, _) = errors.mean(0), np.percentile(errors, 95, axis=0)
    middle = np.mean([np.median(errors[np.array(straight_down) == down], axis=0) for down in set(straight_down)], axis=0)
    return Score(float(place), float(place_95), float(deep), float(deep_95), float(squares), missed, split, int(presses.touching.sum()),
                 false, float(middle[0]), float(middle[1]))


@dataclass(frozen=True)
class HeldOut:
    """Touches that a method found at held-out presses.

    found: a list of touches for each press; straight: (M,) bool, presses that are no drags; number: (M,) int, of each press among those of
    the calibration.
    """

    found: list[list[TouchEstimate]]
    presses: Presses
    straight: np.ndarray
    number: np.ndarray

    def score(self) -> Score:
        """The errors."""
        return score(self.found, self.presses, self.straight)


def held_out(method: type, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> HeldOut:
    """Cross-validate a method by place.

    fitted: result of fit for all presses, of which a model keeps the simulated library. Raises BadCalibration where no place can be held
    out.
    """
    found, held_all = [], []
    number_of = {id(field): k for k, field in enumerate(presses.fields)}
    for fitting, held in presses.held_out():
        fresh, last = method.from_fitted(method.fit(fitting, sensor, fitted), sensor), None
        for field in held.fields:
            number = number_of[id(field)]
            if last is None or number != last + 1:  # of another press: what went before it is no motion
                fitted_to = copy.deepcopy(fresh)
            found.append(fitted_to.estimate(field))
            last = number
        held_all.append(held)
    if not held_all:
        raise BadCalibration('all presses are at one place: none can be held out; add presses elsewhere')
    together = Presses(tuple(f for held in held_all for f in held.fields),
                       *(np.concatenate([getattr(held, name) for held in held_all])
                         for name in ('position', 'depth', 'segment', 'wrench', 'radius')))
    number = np.array([number_of[id(field)] for field in together.fields])
    return HeldOut(found, together, presses.straight()[number], number)


def _errors(touch: TouchEstimate, position: np.ndarray, depth: float) -> tuple[float, float, float]:
    """Errors of place and depth, m, and the normalised squared error of the three together."""
    off = (touch.position - position)[:2]
    deep = touch.depth - depth
    squares = off @ np.linalg.solve(touch.covariance[:2, :2], off) + (deep / touch.depth_sigma)**2
    return float(np.hypot(*off)), abs(float(deep)), float(squares / 3)


def rms_errors(method: TouchMethod, presses: Presses) -> tuple[float, float]:
    """RMS errors, m, of a method's place (per axis) and depth at the presses that it detects; NaN where it detects none."""
    reported = [(touch, position, depth) for field, position, depth in zip(presses.fields, presses.position, presses.depth)
            if depth > 0 for touch in method.estimate(field)[:1]]
    if not reported:
        return float('nan'), float('nan')
    place = np.mean([(touch.position - position)[:2]**2 for touch, position, _ in reported])
    return float(np.sqrt(place)), float(np.sqrt(np.mean([(touch.depth - depth)**2 for touch, _, depth in reported])))


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


def marker_residuals(held: HeldOut, names: Sequence[str]) -> list[Residuals]:
    """Cross-validation errors of position and depth, mm, over the surface; NaN for a press without an estimate.

    names: recording and time of each press of the calibration.
    """
    touching = np.flatnonzero(held.presses.touching)
    off, deep = np.full(len(touching), np.nan), np.full(len(touching), np.nan)
    for row, k in enumerate(touching):
        position, depth = held.presses.position[k], held.presses.depth[k]
        touches = held.found[k]
        if touches:
            nearest = min(touches, key=lambda touch: np.hypot(*(touch.position - position)[:2]))
            off[row], deep[row] = np.hypot(*(nearest.position - position)[:2]), nearest.depth - depth
    places = 1e3 * held.presses.position[touching, :2]
    when = [names[held.number[k]] for k in touching]
    return [Residuals('place', 'mm', 1e3 * off, places, _AXES, when), Residuals('depth', 'mm', 1e3 * deep, places, _AXES, when)]

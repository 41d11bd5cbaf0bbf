# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-validation of touch methods: errors at held-out presses, and the covariance that methods without one of their own state."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass

import numpy as np

from ...errors import BadCalibration
from .presses import Presses
from .touch import TouchEstimate, TouchMethod
from ..view.sensor import MarkerSensor


@dataclass(frozen=True)
class Score:
    """Errors over presses: mean and 95th percentile of place (over x and y) and depth, m; squares: mean normalised squared error of
    place and depth (1 where the stated covariance is honest); missed: presses not found; split: presses told as several; presses: in
    all; false: touches told in untouched frames; place_median, depth_median: m, which presses too shallow to be located do not change; of
    presses straight down and of drags, each counting half, where there are both. NaN where no press was found."""

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


def judge(method: TouchMethod, presses: Presses) -> Score:
    """The errors of a method on presses by one tip each; of several touches told, the one nearest to the tip counts."""
    found = [method.estimate(field) for field in presses.fields]
    return score(found, presses)


def score(found: list[list[TouchEstimate]], presses: Presses, straight: np.ndarray | None = None) -> Score:
    """The errors of the touches found, one list for each of the presses; straight: (M,) bool, those that are no drags, as far as known."""
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
    """What a method told of presses at places that it was not fitted to. found: a list of touches for each of the presses; straight: (M,)
    bool, those that are no drags."""

    found: list[list[TouchEstimate]]
    presses: Presses
    straight: np.ndarray

    def score(self) -> Score:
        """The errors."""
        return score(self.found, self.presses, self.straight)


def held_out(method: type, presses: Presses, sensor: MarkerSensor, fitted: Mapping | None = None) -> HeldOut:
    """What a method of TOUCH_METHODS tells of presses at places that it was not fitted to; fitted: what fit gave for all of them, from
    where methods that have fit_quickly(presses, sensor, fitted) find their way faster, if less exactly. Raises BadCalibration where no
    place can be held out."""
    quick = getattr(method, 'fit_quickly', None)
    found, held_all = [], []
    straight = {id(field): down for field, down in zip(presses.fields, presses.straight())}
    for fitting, held in presses.held_out():
        numbers = method.fit(fitting, sensor) if quick is None or fitted is None else quick(fitting, sensor, fitted)
        fitted_to = method.from_fitted(numbers, sensor)
        found += [fitted_to.estimate(field) for field in held.fields]
        held_all.append(held)
    if not held_all:
        raise BadCalibration('all presses are at one place: none can be held out; add presses elsewhere')
    together = Presses(tuple(f for held in held_all for f in held.fields),
                       *(np.concatenate([getattr(held, name) for held in held_all])
                         for name in ('position', 'depth', 'segment', 'wrench', 'radius')))
    return HeldOut(found, together, np.array([straight[id(field)] for field in together.fields]))


def _errors(touch: TouchEstimate, position: np.ndarray, depth: float) -> tuple[float, float, float]:
    """Errors of place and depth, m, and the normalised squared error of the three together."""
    off = (touch.position - position)[:2]
    deep = touch.depth - depth
    squares = off @ np.linalg.solve(touch.covariance[:2, :2], off) + (deep / touch.depth_sigma)**2
    return float(np.hypot(*off)), abs(float(deep)), float(squares / 3)


def held_out_spread(make: Callable[[Presses], TouchMethod], presses: Presses) -> tuple[float, float]:
    """Root mean square errors, m, of place (each of x and y) and of depth over places left out; NaN where presses are at one place only.

    make: fits a method to presses.
    """
    place, depth = [], []
    for fitting, held in presses.held_out():
        try:
            method = make(fitting)
        except BadCalibration:  # what is left is too little
            continue
        for field, position, deep in zip(held.fields, held.position, held.depth):
            for touch in method.estimate(field)[:1]:
                place.append((touch.position - position)[:2])
                depth.append(touch.depth - deep)
    if not place:
        return float('nan'), float('nan')
    return float(np.sqrt(np.mean(np.square(place)))), float(np.sqrt(np.mean(np.square(depth))))

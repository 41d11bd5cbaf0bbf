# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Cross-validation of touch methods: errors at held-out presses, and the covariance of methods that estimate none."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass

import numpy as np

from ..errors import BadCalibration
from .presses import Presses
from .estimate import TouchEstimate, TouchMethod
from .sensor import MarkerSensor


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


def judge(method: TouchMethod, presses: Presses) -> Score:
    """Errors of a method on presses by one tip each; of several touches detected, the one nearest to the tip counts."""
    found = [method.estimate(field) for field in presses.fields]
    return score(found, presses)


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
    """Cross-validate a method of TOUCH_METHODS by place.

    fitted: result of fit for all presses, from which a method with fit_quickly(presses, sensor, fitted) starts: faster, less accurate.
    Raises BadCalibration where no place can be held out.
    """
    quick = getattr(method, 'fit_quickly', None)
    found, held_all = [], []
    number_of = {id(field): k for k, field in enumerate(presses.fields)}
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
    number = np.array([number_of[id(field)] for field in together.fields])
    return HeldOut(found, together, presses.straight()[number], number)


def _errors(touch: TouchEstimate, position: np.ndarray, depth: float) -> tuple[float, float, float]:
    """Errors of place and depth, m, and the normalised squared error of the three together."""
    off = (touch.position - position)[:2]
    deep = touch.depth - depth
    squares = off @ np.linalg.solve(touch.covariance[:2, :2], off) + (deep / touch.depth_sigma)**2
    return float(np.hypot(*off)), abs(float(deep)), float(squares / 3)


def cross_validation_rmse(make: Callable[[Presses], TouchMethod], presses: Presses) -> tuple[float, float]:
    """Cross-validation RMSE, m, of place (per axis) and of depth; NaN where all presses are at one place.

    make: fits a method to presses; may raise BadCalibration, which skips the fold.
    """
    place, depth = [], []
    for fitting, held in presses.held_out():
        try:
            method = make(fitting)
        except BadCalibration:  # too few presses in this fold
            continue
        for field, position, deep in zip(held.fields, held.position, held.depth):
            for touch in method.estimate(field)[:1]:
                place.append((touch.position - position)[:2])
                depth.append(touch.depth - deep)
    if not place:
        return float('nan'), float('nan')
    return float(np.sqrt(np.mean(np.square(place)))), float(np.sqrt(np.mean(np.square(depth))))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact on an inflated dome by paper air_cushion_contact: change of each marker's mean distance to its five nearest neighbours, weighted
centroid of the four largest changes (eqs 1 to 4), cubic for the depth (eq 5).
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import BadArgument, BadCalibration
from .marker_depth import Cubic, common_rest, rising_cubic
from ..cross_validation import cross_validation_rmse
from ..presses import Presses
from ..estimate import OUT_OF_RANGE, TouchEstimate
from ..field import MarkerField
from ..sensor import MarkerSensor, first_touch_height, rest_points

NEAREST, LARGEST = 5, 4  # neighbours; changes (eq 2)
RANGE = 3.0   # pitches from the largest change within which the others are searched; the paper gives no number. Chosen
QUIET = 2.0   # detection threshold over the largest mean change in untouched frames. Chosen
LEAST = 2e-4  # m, least detection threshold. Chosen


def neighbours(rest: np.ndarray) -> np.ndarray:
    """(K, 5) ids of the five nearest neighbours of each marker at rest (K, 2) m. Raises BadCalibration where fewer are known."""
    apart = np.hypot(*(rest[:, None] - rest[None]).transpose(2, 0, 1))
    apart[~np.isfinite(apart)] = np.inf
    np.fill_diagonal(apart, np.inf)
    if np.isfinite(rest).all(1).sum() <= NEAREST:
        raise BadCalibration(f'at least {NEAREST + 1} markers must be seen; check the image of the untouched dome')
    return np.argsort(apart, axis=1)[:, :NEAREST]


def distance_changes(field: MarkerField, near: np.ndarray) -> np.ndarray:
    """(K,) m, absolute change of the mean distance (eq 1) to the neighbours near (K, 5) that are seen; NaN for a marker not seen."""
    now = field.rest + field.shift

    def mean_distance(places):
        """(K,) m, of places (K, 2) to the neighbours that are seen."""
        distances = np.hypot(*(places[near] - places[:, None]).transpose(2, 0, 1))
        both = seen[near] & seen[:, None]
        return np.where(both, distances, 0.0).sum(1) / np.where(both.any(1), both.sum(1), np.nan)
    seen = field.seen
    return np.abs(mean_distance(now) - mean_distance(field.rest))


def four_largest(changes: np.ndarray, places: np.ndarray, reach: float) -> tuple[np.ndarray, float] | None:
    """Weighted place (2,) m (eqs 2 to 4) and mean change, m, of the four largest changes within reach of the largest; None: no change."""
    changes = np.where(np.isfinite(changes) & np.isfinite(places).all(1), changes, 0.0)
    first = int(changes.argmax())
    if not changes[first] > 0:
        return None
    close = np.hypot(*(places - places[first]).T) <= reach
    four = np.argsort(np.where(close, changes, -1.0))[::-1][:LARGEST]
    four = four[close[four]]
    middle, share = places[four].mean(0), changes[four] / changes[four].sum()
    return middle + share @ (places[four] - middle), float(changes[four].mean())


class PaperCushion:
    """The paper's method on a dome; detects one touch at most."""

    def __init__(self, rest: np.ndarray, points: np.ndarray, cubic: Cubic, sensor: MarkerSensor, numbers: Mapping):
        self.rest, self.points, self.cubic, self.sensor = rest, points, cubic, sensor
        self.near = neighbours(rest)
        self.quiet, self.place_sigma, self.depth_sigma = (float(numbers[k]) for k in ('quiet', 'place_sigma', 'depth_sigma'))

    def measure(self, field: MarkerField) -> tuple[np.ndarray, float] | None:
        """Place (2,) m in sensor x and y, and mean change, m; None where nothing changed. Raises BadArgument for another pattern."""
        if len(field) != len(self.rest):
            raise BadArgument(f'calibrated for {len(self.rest)} markers, got a field of {len(field)}')
        return four_largest(distance_changes(field, self.near), self.points[:, :2], RANGE * max(self.sensor.pitch))

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame, with the cross-validation RMSE as covariance; empty without contact."""
        found = self.measure(field)
        if found is None or not found[1] > self.quiet:
            return []
        depth, outside = (value.item() for value in self.cubic(np.array(found[1])))
        height = first_touch_height(found[0], 0.0, self.sensor)[0] - depth
        variance = np.square([self.place_sigma, self.place_sigma, self.depth_sigma])
        return [TouchEstimate(np.append(found[0], height), depth, np.diag(variance), self.depth_sigma,
                              flags=OUT_OF_RANGE if outside else 0)]

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file. Raises BadCalibration where the presses determine no rising cubic."""
        numbers = cls._numbers(presses, sensor)
        rmse = cross_validation_rmse(lambda some: cls.from_fitted(cls._numbers(some, sensor), sensor), presses)
        return numbers | dict(zip(('place_sigma', 'depth_sigma'), rmse))

    @classmethod
    def _numbers(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        rest, eye = common_rest(presses.fields)
        near, places = neighbours(rest), rest_points(rest, eye, sensor)[:, :2]
        found = [four_largest(distance_changes(field, near), places, RANGE * max(sensor.pitch)) for field in presses.fields]
        change = np.array([0.0 if f is None else f[1] for f in found])
        cubic = rising_cubic(change[presses.touching], presses.depth[presses.touching])
        if cubic is None:
            raise BadCalibration('the distances between markers do not grow with depth; check the presses\' depths')
        quiet = max(QUIET * change[~presses.touching].max(initial=0.0), LEAST)
        return {'rest': rest, 'eye': eye, 'coefficients': cubic.coefficients.tolist(), 'top': cubic.top,
                'sigma': cubic.sigma, 'quiet': float(quiet), 'place_sigma': float('nan'), 'depth_sigma': float('nan')}

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> PaperCushion:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            rest, eye = np.array(fitted['rest'], float), np.array(fitted['eye'], float)
            cubic = Cubic(np.array(fitted['coefficients'], float), float(fitted['top']), float(fitted['sigma']))
            return cls(rest, rest_points(rest, eye, sensor), cubic, sensor, fitted)
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the air cushion\'s method in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong

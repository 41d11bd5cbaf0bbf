# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point on an inflated dome from the whole displacement field: the learned dent (regression_dent) that explains it best.

Place, depth and the depth that the dent's shape is taken from are free, and so is a little depth right under the tip: a larger or smaller
object than the calibrated one dents the dome more or less around its tip than that.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import BadArgument, BadCalibration
from .estimate import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from .field import MarkerField
from .paper_depth import common_rest
from .presses import Presses
from .regression_dent import BUMP, LOG_DEPTH, LOG_SHAPE, Dent, learn_dent
from .regression_start import QUIETER, SEEN, SURE, quiet_noise
from .rest_surface import dome_cap, first_touch_height, rest_points
from .sensor import MarkerSensor

FEWEST = 6               # presses
STEPS = np.array([1e-5, 1e-5, 1e-4, 1e-4, 1e-5])
LIMIT = np.array([0.01, 0.01, 0.5, 0.5, 0.005])  # of one step
SETTLED = 3e-3           # of these
ITERATIONS = 10
SHAPE_SIGMA = 0.1        # log: how much deeper or shallower a dent may look than it is
BUMP_SIGMA = 0.05        # of the depth: the same, right under the tip
MISFIT, MISFIT_TOP = 0.02, 0.006  # of a marker's displacement, and of the greatest: what a dent is wrong by
TOOL_PLACE = 0.02        # of the way from the apex: what another tool's size shifts the touch on the slope by
FOLLOW = 3               # iterations for which derivatives are taken anew
RADII = np.arange(0.0, 0.0801, 0.001)  # m, of the calibrated tip
RINGS, DEPTHS = (0.0, 0.07, 0.14, 0.21, 0.28, 0.35, 0.42), (0.15, 0.4, 0.7, 1.0)  # of rim radius and deepest press, to start from
BEYOND = 1.15            # times the deepest calibrated press: deeper is out of range


class DomeRegression:
    """Fitted for one dome. Tells one touch at the most."""

    def __init__(self, dent: Dent, sensor: MarkerSensor, numbers: Mapping):
        self.dent, self.sensor = dent, sensor
        self.noise, self.deepest, self.reach, self.radius, self.widen, quiet = (
            float(numbers[name]) for name in ('noise', 'deepest', 'reach', 'tip_radius', 'widen', 'quiet'))
        self.threshold = max(SURE, QUIETER * quiet)
        self._starts = self._library()
        self._shown = np.nan_to_num([dent.appear(start) for start in self._starts]).reshape(len(self._starts), -1)
        self._sizes = np.sum(self._shown**2, axis=1)

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame; empty where displacements are no more than noise. Raises BadArgument for another pattern."""
        if len(field) != len(self.dent.out):
            raise BadArgument(f'calibrated for {len(self.dent.out)} markers, got a field of {len(field)}')
        if field.seen.sum() < SEEN:
            return []
        score, start = self.score(field)
        return [self._told(*self._fit(field, start))] if score > self.threshold else []

    def score(self, field: MarkerField) -> tuple[float, np.ndarray]:
        """How many standard deviations of noise the best of the starting dents stands out by, and its parameters."""
        shift = np.nan_to_num(field.shift).ravel()
        match = self._shown @ shift
        score = match / np.sqrt(self._sizes) / np.median(self._sigma(field)[field.seen])
        nearest = int(np.argmin(self._sizes - 2 * match))
        return float(score.max()), self._starts[nearest]

    def _sigma(self, field):
        return np.where(np.isfinite(field.sigma), np.maximum(field.sigma, self.noise / 2), self.noise)

    def _fit(self, field: MarkerField, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        parameters, seen, sigma = start.copy(), np.repeat(field.seen, 2), self._sigma(field)
        for turn in range(ITERATIONS):
            told = self.dent.appear(parameters)
            if turn < FOLLOW:
                slope = np.stack([(self.dent.appear(parameters + step) - told).ravel() for step in np.diag(STEPS)], axis=1) / STEPS
                slope = np.where(seen[:, None], np.nan_to_num(slope), 0.0)
                size = np.hypot(*np.nan_to_num(told).T)
                weight = 1 / np.repeat(sigma**2 + (MISFIT * size)**2 + (MISFIT_TOP * size.max())**2, 2)
            off = np.where(seen, np.nan_to_num(field.shift - told).ravel(), 0.0)
            normal, pull = self._add_prior(parameters, slope.T @ (slope * weight[:, None]), slope.T @ (off * weight))
            step = np.linalg.solve(normal, pull)
            step *= min(1.0, (LIMIT / np.maximum(np.abs(step), 1e-15)).min())
            parameters += step
            if (np.abs(step) < SETTLED * LIMIT).all():
                break
        return parameters, np.linalg.inv(normal)

    def _add_prior(self, parameters, normal, pull):
        alike = np.zeros(5)
        alike[[LOG_DEPTH, LOG_SHAPE]] = -1.0, 1.0
        bump = np.zeros(5)
        bump[BUMP] = 1.0
        for row, sigma in ((alike, SHAPE_SIGMA), (bump, BUMP_SIGMA * np.exp(parameters[LOG_DEPTH]))):
            normal = normal + np.outer(row, row) / sigma**2
            pull = pull - row * (row @ parameters) / sigma**2
        return normal, pull

    def _told(self, parameters, covariance) -> TouchEstimate:
        place = parameters[:2] * min(1.0, 0.95 * self.sensor.rim_radius / max(np.hypot(*parameters[:2]), 1e-9))
        amplitude = np.exp(parameters[LOG_DEPTH])
        depth = float(max(amplitude + parameters[BUMP], 1e-6))
        row = np.array([0, 0, amplitude, 0, 1.0])
        depth_variance = row @ covariance @ row * self.widen
        place_covariance = covariance[:2, :2] * self.widen + TOOL_PLACE**2 * np.outer(place, place)
        full = np.zeros((3, 3))
        full[:2, :2], full[2, 2] = place_covariance, depth_variance
        flags = OUT_OF_RANGE * (depth > BEYOND * self.deepest) | AT_EDGE * bool(np.hypot(*place) > self.reach)
        height = first_touch_height(place, self.radius, self.sensor)[0] - depth
        return TouchEstimate(np.append(place, height), depth, full, float(np.sqrt(depth_variance)), flags=int(flags))

    def _library(self) -> np.ndarray:
        starts = []
        for ring in RINGS:
            count = max(1, round(2 * np.pi * ring / RINGS[1]))
            for turn in np.arange(count) * 2 * np.pi / count:
                place = ring * self.sensor.rim_radius * np.array([np.cos(turn), np.sin(turn)])
                starts += [[*place, np.log(part * self.deepest), np.log(part * self.deepest), 0.0] for part in DEPTHS]
        return np.array(starts)

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Numbers for the calibration file. Raises BadCalibration for too few presses."""
        numbers = cls._numbers(presses, sensor)
        squares = []
        for fitting, held in presses.held_out():
            if fitting.touching.sum() >= FEWEST:
                squares += cls.from_fitted(cls._numbers(fitting, sensor), sensor)._squares(held)
        return numbers | {'widen': float(max(1.0, np.mean(squares))) if squares else 1.0}

    @classmethod
    def _numbers(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        touched = presses.select(presses.touching & np.array([field.seen.sum() >= SEEN for field in presses.fields]))
        if len(touched) < FEWEST:
            raise BadCalibration(f'{len(touched)} presses are too few for a regression; {FEWEST} are needed')
        rest, eye = common_rest(presses.fields)
        tip = _tip_radius(touched, sensor)
        cap, deepest = dome_cap(sensor), float(touched.depth.max())
        towards = tip / (cap.curvature_radius + tip)
        dent = Dent(rest, eye, rest_points(rest, eye, sensor), cap, sensor.plane_z, towards, deepest / 2)
        dent.coefficients = learn_dent(dent, [field.shift for field in touched.fields], touched.position[:, :2], touched.depth,
                                       touched.places())
        reach = np.hypot(*touched.position[:, :2].T).max() + max(sensor.pitch)
        numbers = {'rest': rest.tolist(), 'eye': eye.tolist(), 'towards': towards, 'unit': deepest / 2, 'tip_radius': tip, 'quiet': 0.0,
                   'coefficients': dent.coefficients.tolist(), 'noise': quiet_noise(presses), 'deepest': deepest, 'reach': float(reach),
                   'widen': 1.0}
        method = cls(dent, sensor, numbers)
        quiet = max((method.score(field)[0] for field, on in zip(presses.fields, presses.touching) if not on), default=0.0)
        return numbers | {'quiet': float(quiet)}

    def _squares(self, presses: Presses) -> list[float]:
        """Normalised squared errors of presses that are found."""
        squares = []
        for field, position, depth in zip(presses.fields, presses.position, presses.depth):
            for touch in self.estimate(field):
                off = (touch.position - position)[:2]
                squares.append((off @ np.linalg.solve(touch.covariance[:2, :2], off) + ((touch.depth - depth) / touch.depth_sigma)**2) / 3)
        return squares

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> DomeRegression:
        """Back from the calibration file. Raises BadCalibration where something is missing."""
        try:
            rest, eye = np.array(fitted['rest'], float), np.array(fitted['eye'], float)
            dent = Dent(rest, eye, rest_points(rest, eye, sensor), dome_cap(sensor), sensor.plane_z, float(fitted['towards']),
                        float(fitted['unit']), np.array(fitted['coefficients'], float))
            return cls(dent, sensor, fitted)
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the regression cannot be read from the calibration ({wrong!r}); calibrate anew') from wrong


def _tip_radius(touched: Presses, sensor: MarkerSensor) -> float:
    """m, of the tip whose lowest point stands where the presses say at first touch."""
    first = touched.position[:, 2] + touched.depth
    off = [np.nansum((first_touch_height(touched.position[:, :2], radius, sensor) - first)**2) for radius in RADII]
    return float(RADII[int(np.argmin(off))])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point on an inflated dome from the whole displacement field: fit of the learned dent (dome_basis).

Place and depth are free parameters; the depth that determines the dent's shape may differ slightly. The markers hardly show the size of
the object: for one larger or smaller than the calibrated tip the error grows with depth and slope, which the covariance includes
(_size_error).
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .dome_basis import LOG_DEPTH, SHALLOW, Dent, DentFit
from .dome_fit import APART, DentFound, DentSolver
from ...errors import BadArgument, BadCalibration
from .matched_filter import QUIETER, SEEN, SURE, quiet_noise
from ..published.marker_depth import common_rest
from ..touches.presses import Presses
from ..touches.touch import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor, dome_cap, first_touch_height, rest_points

FEWEST = 6               # presses needed for a fit. Chosen
MOST = 80                # presses used for cross-validation of the ridge. Chosen
RIDGES = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3)  # candidates
DEPTH_COUNTS = 4.0       # weight of the depth error over the place error in that choice. Chosen
MEDIAN_SQUARE = 0.79     # median of chi-square with three degrees of freedom, over three
SIZE_SIGMA = 0.3         # standard deviation of the log of object size over the calibrated tip. Chosen
UNDER_TIP = 0.17         # error of depth over depth and log size: a smaller tip goes deeper for the same dent around it. Chosen
RADII = np.arange(0.0, 0.0801, 0.001)  # m, candidates for the calibrated tip
SEVERAL = 1.5            # normalised mean square residual of one dent from which two are tried. Chosen
EVIDENCE = 1.4           # least ratio of squared residuals, one dent over two, times the ratio of the two depths. Chosen
UNEXPLAINED = 15.0       # normalised mean square residual from which an estimate is ambiguous. Chosen
BEYOND = 1.15            # times the deepest calibrated press: deeper is out of range. Chosen


class DomeRegression:
    """Fitted to one dome; detects two touches at most."""

    def __init__(self, dent: Dent, sensor: MarkerSensor, numbers: Mapping):
        self.dent, self.sensor = dent, sensor
        self.noise, self.deepest, self.farthest, self.radius, self.widen, self.size_sigma, quiet = (
            float(numbers[name]) for name in ('noise', 'deepest', 'farthest', 'tip_radius', 'widen', 'size_sigma', 'quiet'))
        self.threshold = max(SURE, QUIETER * quiet)
        self.solver = DentSolver(dent, self.noise, self.deepest, max(sensor.pitch))

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touches of one frame; empty where displacements do not exceed the noise. Raises BadArgument for another pattern."""
        found = self.dents(field)
        if found is None:
            return []
        # Residuals beyond the noise, as of a drag, widen the covariance.
        misfit = found.squares / (2 * field.seen.sum())
        covariance, flags = found.covariance * max(1.0, misfit), AMBIGUOUS * (misfit > UNEXPLAINED)
        return [self._touch(one, covariance[4 * k:4 * k + 4, 4 * k:4 * k + 4], flags) for k, one in enumerate(found.parameters)]

    def dents(self, field: MarkerField) -> DentFound | None:
        """The dents of one frame; None without contact. Raises BadArgument for another pattern."""
        if len(field) != len(self.dent.out):
            raise BadArgument(f'calibrated for {len(self.dent.out)} markers, got a field of {len(field)}')
        if field.seen.sum() < SEEN or not self.solver.score(field) > self.threshold:
            return None
        one = self.solver.solve(field, self.solver.start(field))
        if not one.squares > SEVERAL * 2 * field.seen.sum():
            return one
        two = self.solver.solve(field, self.solver.start_of_two(field))
        return two if self._are_two(one, two) else one

    def raised(self, field: MarkerField) -> tuple[np.ndarray, np.ndarray] | None:
        """Upward displacement (K,), m, of the markers but for the scale about the eye, and places (n, 2), m, of the dents; None without
        contact."""
        found = self.dents(field)
        return None if found is None else (self.solver.moved(found)[:, 2], found.parameters[:, :2])

    def _are_two(self, one: DentFound, two: DentFound) -> bool:
        """Whether two dents explain the field significantly better than one."""
        depth = np.exp(two.parameters[:, LOG_DEPTH])
        apart = np.hypot(*(two.parameters[0, :2] - two.parameters[1, :2]))
        evidence = one.squares / max(two.squares, 1e-9) * depth.min() / depth.max()
        return bool(evidence > EVIDENCE and apart > APART * max(self.sensor.pitch))

    def _touch(self, parameters, covariance, flags: int) -> TouchEstimate:
        place = parameters[:2] * min(1.0, 0.95 * self.sensor.rim_radius / max(np.hypot(*parameters[:2]), 1e-9))
        depth = float(np.exp(parameters[LOG_DEPTH]))
        turned = np.diag([1.0, 1.0, -depth])  # from log depth to height
        full = turned @ covariance[:3, :3] @ turned * self.widen + self._size_error(place, depth)
        flags = flags | OUT_OF_RANGE * (depth > BEYOND * self.deepest) | AT_EDGE * bool(np.hypot(*place) > self.farthest)
        height = first_touch_height(place, self.radius, self.sensor)[0] - depth
        return TouchEstimate(np.append(place, height), depth, full, float(np.sqrt(full[2, 2])), flags=int(flags))

    def _size_error(self, place: np.ndarray, depth: float) -> np.ndarray:
        """(3, 3) m^2: covariance due to the unknown size of the object.

        The tip of a ball of radius rho that touches a sphere of radius R is farther out than the touch by the share rho / R. The skin's
        depth falls off with the log of the distance, so a smaller ball goes deeper for the same dent around it.
        """
        outward = np.append(self.dent.towards * (1 - self.dent.towards) * place, 0.0)
        under = np.array([0.0, 0.0, (1 - self.dent.towards) * UNDER_TIP * depth])
        return self.size_sigma**2 * (np.outer(outward, outward) + np.outer(under, under))

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file. Raises BadCalibration for too few presses.

        The ridge minimises the error over training and held-out presses together.
        """
        some = _some(presses)
        learned = cls._numbers(presses, sensor, RIDGES)
        errors = {ridge: cls.from_fitted(learned[ridge], sensor)._errors(some) for ridge in RIDGES}
        for fitting, held in some.held_out():
            if fitting.touching.sum() >= FEWEST:
                for ridge, numbers in cls._numbers(fitting, sensor, RIDGES).items():
                    errors[ridge] += cls.from_fitted(numbers, sensor)._errors(held)
        ridge = min(RIDGES, key=lambda ridge: sum(error[0] for error in errors[ridge]))
        widen = max(1.0, np.median([error[1] for error in errors[ridge]]) / MEDIAN_SQUARE)
        return learned[ridge] | {'widen': float(widen), 'size_sigma': SIZE_SIGMA}

    @classmethod
    def _numbers(cls, presses: Presses, sensor: MarkerSensor, ridges) -> dict[float, dict]:
        """Parameters for each ridge."""
        touched = presses.select(presses.touching & np.array([field.seen.sum() >= SEEN for field in presses.fields]))
        if len(touched) < FEWEST:
            raise BadCalibration(f'{len(touched)} presses are too few for a regression; {FEWEST} are needed')
        rest, eye = common_rest(presses.fields)
        tip, cap, deepest = _tip_radius(touched, sensor), dome_cap(sensor), float(touched.depth.max())
        towards = tip / (cap.curvature_radius + tip)
        dent = Dent(rest, eye, rest_points(rest, eye, sensor), cap, sensor.plane_z, towards, deepest / 2)
        straight = touched.select(_straight(touched))
        fit = DentFit(dent, [field.shift for field in straight.fields], straight.position[:, :2], straight.depth)
        farthest = np.hypot(*touched.position[:, :2].T).max() + max(sensor.pitch)
        numbers = {'rest': rest.tolist(), 'eye': eye.tolist(), 'towards': towards, 'unit': deepest / 2, 'tip_radius': tip, 'quiet': 0.0,
                   'noise': quiet_noise(presses), 'deepest': deepest, 'farthest': float(farthest), 'widen': 1.0, 'size_sigma': 0.0}
        return {ridge: cls._with_quiet(dent, numbers | {'coefficients': fit.coefficients(ridge).tolist()}, presses, sensor)
                for ridge in ridges}

    @classmethod
    def _with_quiet(cls, dent: Dent, numbers: dict, presses: Presses, sensor: MarkerSensor) -> dict:
        method = cls(dent.with_coefficients(np.array(numbers['coefficients'])), sensor, numbers)
        quiet = max((method.solver.score(field) for field, on in zip(presses.fields, presses.touching) if not on), default=0.0)
        return numbers | {'quiet': float(quiet)}

    def _errors(self, presses: Presses) -> list[tuple[float, float]]:
        """Weighted error of place and depth, m, and normalised squared error of each press; a press not found counts the rim's radius."""
        errors = []
        for field, position, depth in zip(presses.fields, presses.position, presses.depth):
            if depth < SHALLOW * self.deepest:
                continue
            found = self.estimate(field)
            if not found:
                errors.append((self.sensor.rim_radius, np.inf))
                continue
            off, deeper = (found[0].position - position)[:2], found[0].depth - depth
            squares = off @ np.linalg.solve(found[0].covariance[:2, :2], off) + (deeper / found[0].depth_sigma)**2
            errors.append((float(np.hypot(*off) + DEPTH_COUNTS * abs(deeper)), float(squares / 3)))
        return errors

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> DomeRegression:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            rest, eye = np.array(fitted['rest'], float), np.array(fitted['eye'], float)
            dent = Dent(rest, eye, rest_points(rest, eye, sensor), dome_cap(sensor), sensor.plane_z, float(fitted['towards']),
                        float(fitted['unit']), np.array(fitted['coefficients'], float))
            return cls(dent, sensor, fitted)
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the regression in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong


def _some(presses: Presses) -> Presses:
    """At most MOST of the straight presses, chosen at random, and the untouched frames."""
    straight = np.flatnonzero(_straight(presses))
    keep = ~presses.touching
    keep[np.random.default_rng(0).permutation(straight)[:MOST]] = True
    return presses.select(keep)


def _straight(presses: Presses) -> np.ndarray:
    """(M,) bool: presses at places with at least half the median number of presses; a dragged tip stays nowhere for long."""
    places, touching = presses.places() + 1, presses.touching
    count = np.bincount(places)[places]
    return touching & (count > 0.5 * np.median(count[touching]))


def _tip_radius(touched: Presses, sensor: MarkerSensor) -> float:
    """Tip radius, m, for which the height of first contact fits the presses best."""
    first = touched.position[:, 2] + touched.depth
    off = [np.nansum((first_touch_height(touched.position[:, :2], radius, sensor) - first)**2) for radius in RADII]
    return float(RADII[int(np.argmin(off))])

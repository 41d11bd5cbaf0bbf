# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point of a marker sheet by regression on the whole displacement field.

The parameters of the best fitting bell (green_function_fit) are the features. Their errors, smooth functions of the tip's true place and
depth, are learned from the calibration presses and their mirror images (Gaussian process). An estimate solves for the place and depth that
predict the features; this inverse regression is not biased towards the calibrated places.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import BadArgument, BadCalibration
from .gaussian_process import MirrorGP, mirror_groups
from .green_function import CARRIED, DEPTH, PLACE, POWER, ROUND, SheetBell
from .green_function_fit import BellFit, BellFitter, ShapePrior, broad_prior
from .matched_filter import SEEN, BellStart, quiet_noise
from ..published.marker_depth import common_rest
from ..touches.presses import Presses
from ..touches.touch import AT_EDGE, OUT_OF_RANGE, TouchEstimate
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor

FEWEST = 6                      # presses needed for a fit. Chosen
ROUNDS = 3                      # alternations of fitting the in-plane factors and the shape prior. Chosen
TOOLS = np.array([0.1, 0.01])   # added standard deviation of log tip width and log power, for other tips. Chosen
PARITIES = ((-1, 1), (1, -1), (1, 1))  # symmetry of the errors of x, y and log depth along x and y
BEYOND = 1.15                   # times the deepest calibrated press: deeper is out of range. Chosen
DRAG = 0.05                     # of the short side: standard deviation of drag, where the calibration contains drags. Chosen
OWN_SHARE = 0.5                 # of the bell fit's covariance that the learned errors do not cover. Chosen
NARROWED = 1.5                  # factor of places over half sides in the inputs. Chosen
TURNS = 4                       # fixed-point iterations; each reduces the error tenfold or more


class SheetRegression:
    """Fitted to one sheet; detects one touch at most.

    errors: of the features x, y (m) and log depth, the last about mean_error; reach: (2,) m, half sides of the calibrated rectangle;
    carry, carry_sigma: offset of the tip from the bell over the fitted drag, and its standard deviation.
    """

    def __init__(self, fitter: BellFitter, start: BellStart, errors: list[MirrorGP], numbers: Mapping):
        self.fitter, self.start, self.errors = fitter, start, errors
        self.deepest, self.widen, self.mean_error = (float(numbers[name]) for name in ('deepest', 'widen', 'mean_error'))
        self.carry, self.carry_sigma = (float(numbers.get(name, 0.0)) for name in ('carry', 'carry_sigma'))
        self.reach = np.array(numbers['reach'], float)

    def estimate(self, field: MarkerField) -> list[TouchEstimate]:
        """The touch of one frame; empty where displacements do not exceed the noise. Raises BadArgument for another pattern."""
        if len(field) != self.fitter.bell.count:
            raise BadArgument(f'calibrated for {self.fitter.bell.count} markers, got a field of {len(field)}')
        begin = self.start.find(field)
        return [] if begin is None else [self._touch(self.fitter.fit(field.shift, self.start.noise(field), begin))]

    def _touch(self, fit: BellFit) -> TouchEstimate:
        found = self._solve(fit.parameters[:3] + [*(self.carry * fit.parameters[CARRIED]), -self.mean_error])
        variance = self._variance(found, fit) * self.widen
        half, depth = self.fitter.half, float(np.exp(found[DEPTH]))
        place, depth_sigma = np.clip(found[PLACE], -half, half), float(depth * np.sqrt(variance[DEPTH]))
        flags = OUT_OF_RANGE * (depth > BEYOND * self.deepest) | AT_EDGE * bool((np.abs(place) > self.reach).any())
        return TouchEstimate(np.append(place, -depth), depth, np.diag(np.append(variance[PLACE], depth_sigma**2)), depth_sigma,
                             flags=int(flags))

    def _solve(self, features):
        found = features.copy()
        for _ in range(TURNS):
            at = inputs(found, self.fitter.half, self.deepest)
            found = features - [error(at) for error in self.errors]
        return found

    def _variance(self, found, fit):
        at = inputs(found, self.fitter.half, self.deepest)
        learned = np.square([error.sigma(at) for error in self.errors]) + OWN_SHARE * np.diag(fit.covariance)[:3]
        return learned + np.append(np.full(2, np.mean(fit.parameters[CARRIED]**2) * self.carry_sigma**2), 0.0)

    @classmethod
    def fit(cls, presses: Presses, sensor: MarkerSensor) -> dict:
        """Parameters for the calibration file. Raises BadCalibration for too few presses."""
        known = presses.touching & np.array([field.seen.sum() >= SEEN for field in presses.fields])
        straight = known & presses.straight()
        straight = straight if straight.sum() >= FEWEST else known
        touched, dragged = presses.select(straight), presses.select(known & ~straight)
        if len(touched) < FEWEST:
            raise BadCalibration(f'{len(touched)} presses are too few for a regression; {FEWEST} are needed')
        rest, eye = common_rest(presses.fields)
        noise = quiet_noise(presses)
        bell = SheetBell(np.array(sensor.size), rest, eye, _marker_radius(presses.fields[0]))
        fitter = _learn_shape(bell, rest, touched, noise)
        start = BellStart(bell, noise, 0.0)
        fitter.drag = float(DRAG * fitter.short) if len(dragged) >= FEWEST else 0.0
        numbers = {'rest': rest.tolist(), 'eye': eye.tolist(), 'radius': bell.radius, 'draw': bell.draw.tolist(), 'noise': noise,
                   'quiet': _quiet(start, presses), 'drag': fitter.drag,
                   'shape': fitter.prior.coefficients.tolist(), 'shape_sigma': fitter.prior.sigma.tolist(),
                   'deepest': float(touched.depth.max()), 'widen': 1.0,
                   'reach': (np.abs(touched.position[:, :2]).max(axis=0) + np.array(sensor.pitch)).tolist()}
        numbers['carry'], numbers['carry_sigma'] = _carrying(*_all_fitted(fitter, start, dragged)) if fitter.drag else (0.0, 0.0)
        fits, truth = _all_fitted(fitter, start, touched)
        error = np.array([fit.parameters[:3] + [*(numbers['carry'] * fit.parameters[CARRIED]), 0] for fit in fits]) - truth
        numbers['mean_error'] = float(error[:, DEPTH].mean())
        at = np.array([inputs(row, fitter.half, numbers['deepest']) for row in truth])
        values = error - [0, 0, numbers['mean_error']]
        errors = [MirrorGP(at, values[:, k], np.zeros(len(at)), parity) for k, parity in enumerate(PARITIES)]
        numbers['errors'] = [process.numbers() for process in errors]
        numbers['widen'] = cls(fitter, start, errors, numbers)._widening(fits, truth)
        return numbers

    def _widening(self, fits, truth) -> float:
        """Factor of the variances from cross-validation by place, mirror images together; at least 1."""
        squares = []
        for k, error in enumerate(self.errors):
            off, sigma = error.left_out(mirror_groups(truth[:, :2]))
            squares.append(off**2 / (sigma**2 + OWN_SHARE * np.array([fit.covariance[k, k] for fit in fits])))
        return float(max(1.0, np.mean(squares)))

    @classmethod
    def from_fitted(cls, fitted: Mapping, sensor: MarkerSensor) -> SheetRegression:
        """From the calibration file. Raises BadCalibration where something is missing."""
        try:
            rest, eye = np.array(fitted['rest'], float), np.array(fitted['eye'], float)
            bell = SheetBell(np.array(sensor.size), rest, eye, float(fitted['radius']), np.array(fitted['draw'], float))
            prior = ShapePrior(np.array(fitted['shape'], float), np.array(fitted['shape_sigma'], float))
            start = BellStart(bell, float(fitted['noise']), float(fitted['quiet']))
            errors = [MirrorGP.from_numbers(numbers) for numbers in fitted['errors']]
            return cls(BellFitter(bell, rest, prior, float(fitted.get('drag', 0.0))), start, errors, fitted)
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the regression in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong


def inputs(state: np.ndarray, half: np.ndarray, deepest: float) -> np.ndarray:
    """(3,) inputs of the Gaussian processes: place over the half sides, and a log of depth that is linear for shallow presses."""
    return np.append(NARROWED * state[PLACE] / half, np.log1p(np.exp(state[DEPTH]) / (0.2 * deepest)))


def _learn_shape(bell: SheetBell, rest, touched: Presses, noise: float) -> BellFitter:
    """Fit the in-plane factors and the shape prior in turn, with places and depths fixed at the ground truth."""
    fitter = BellFitter(bell, rest, broad_prior(bell.size))
    states = np.column_stack([touched.position[:, :2], np.log(touched.depth)])
    for _ in range(ROUNDS):
        held, normal, pull = [], 0.0, 0.0
        for field, state in zip(touched.fields, states):
            parameters = fitter.fit(field.shift, np.where(np.isfinite(field.sigma), field.sigma, noise), state, hold=True).parameters
            plain, drawn = bell.appear(parameters[None])
            off, part = (field.shift - plain[0]).ravel(), drawn[0].reshape(-1, len(bell.draw))
            seen = np.isfinite(off) & np.isfinite(part).all(1)
            part, off = part[seen] / np.exp(state[DEPTH]), off[seen] / np.exp(state[DEPTH])
            normal, pull = normal + part.T @ part, pull + part.T @ off
            held.append(parameters)
        bell.draw = np.linalg.solve(normal + 1e-3 * np.diag(np.diag(normal)), pull)
    basis, shapes = np.array([fitter.shape_basis(parameters) for parameters in held]), np.array(held)[:, ROUND:POWER + 1]
    ridge = 1e-3 * len(basis) * np.diag([0.0, 1.0, 1.0, 1.0])
    coefficients = np.linalg.solve(basis.T @ basis + ridge, basis.T @ shapes)
    sigma = np.hypot((shapes - basis @ coefficients).std(axis=0), TOOLS)
    return BellFitter(bell, rest, ShapePrior(coefficients.T, sigma))


def _all_fitted(fitter: BellFitter, start: BellStart, presses: Presses) -> tuple[list[BellFit], np.ndarray]:
    """Fits to all presses, and their ground truth (N, 3): places, m, and log depths."""
    truth = np.column_stack([presses.position[:, :2], np.log(presses.depth)])
    return [_fitted(fitter, start, *pair) for pair in zip(presses.fields, truth)], truth


def _carrying(fits: list[BellFit], truth: np.ndarray) -> tuple[float, float]:
    """Offset of the tip from the bell over the fitted drag, and its standard deviation."""
    off, carried = truth[:, :2] - np.array([fit.parameters[:2] for fit in fits]), np.array([fit.parameters[CARRIED] for fit in fits])
    size = np.hypot(*carried.T)
    sane = np.hypot(*off.T) < 3 * np.maximum(size, np.median(size))
    squares = np.sum(carried[sane]**2)
    carry = float(np.clip(np.sum(off[sane] * carried[sane]) / max(squares, 1e-12), 0, 1.5))
    return carry, float(np.sqrt(np.sum((off - carry * carried)[sane]**2) / max(squares, 1e-12)))


def _fitted(fitter: BellFitter, start: BellStart, field: MarkerField, truth) -> BellFit:
    """Fit from the matched filter, as in use; from the ground truth where it detects nothing."""
    begin = start.find(field)
    return fitter.fit(field.shift, start.noise(field), truth if begin is None else begin)


def _quiet(start: BellStart, presses: Presses) -> float:
    return float(max((start.scores(field)[0].max() for field, on in zip(presses.fields, presses.touching) if not on), default=0.0))


def _marker_radius(field: MarkerField) -> float:
    """m, radius of a disc of the markers' median area."""
    seen = np.flatnonzero(np.isfinite(field.rest).all(1) & np.isfinite(field.uv - field.duv).all(1))
    gaps = [np.hypot(*np.diff(places[seen], axis=0).T) for places in (field.rest, field.uv - field.duv)]
    scale = np.median(gaps[0] / np.maximum(gaps[1], 1e-9))
    return float(scale * np.sqrt(np.nanmedian(field.area * np.exp(-np.nan_to_num(field.growth))) / np.pi))

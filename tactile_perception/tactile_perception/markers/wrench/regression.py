# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Wrench of a touch from its place, its depth and the lateral displacement of the markers around it, fitted to recorded wrenches.

A touch method that knows the mechanics of its sheet gives the wrench but for the sheet's stiffness, which the recorded wrenches determine;
a sheet's model also gives that of the touches which the regression tells.
Else the normal force follows from place and depth, and the lateral force from the mean displacement of the markers around
the tip. The log of the normal force, the direction of the force and the moment
about the tip over the normal force are linear in features of place and drag that have the sensor's mirror symmetries, with coefficients
that vary smoothly with place and depth (varying_coefficients).
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...errors import BadCalibration
from ..touches.presses import Presses
from ..touches.touch import TouchEstimate, TouchMethod
from .varying_coefficients import VaryingFactors
from ..view.marker_field import MarkerField
from ..view.sensor import MarkerSensor

FEWEST = 6             # presses needed for a fit. Chosen
MOST = 250             # presses used; an even selection of more. Chosen: the time of a fit grows with the cube
ABOUT = 1.5            # marker pitches: Gaussian width of the neighbourhood whose mean displacement is the drag. Chosen
SHALLOW = 0.1          # of the deepest press: shallower presses have more noise, with the inverse square of depth. Chosen
FLOOR = 0.02           # of the deepest press: shallower presses are left out, and drag is divided by no less. Chosen
BEYOND = 3.0           # times the deepest press: deeper touches have no wrench (NaN). Chosen
EXCITED = 0.01         # of the largest force or moment: an axis with a smaller standard deviation is not reported. Chosen
PLACES = 3             # with fewer places (mirror images count once), cross-validation does not decide on axes. Chosen
AXES = ('Fx', 'Fy', 'Fz', 'Mx', 'My', 'Mz')
_FEATURES = (3, 2, 2, 2, 2, 3)  # numbers of features: log normal force; lateral force x, y and moment about the tip over normal force
_PARTS = len(_FEATURES)


def fit_wrench_map(presses: Presses, sensor: MarkerSensor, method: TouchMethod | None = None) -> dict:
    """Parameters of a map fitted to the presses with a known wrench; method: one whose touches have a wrench, which then counts.

    held_out_force, held_out_moment: median relative cross-validation errors; told: which axes are reported. Raises BadCalibration for too
    few presses.
    """
    deepest = float(presses.depth.max(initial=0.0))
    known = presses.touching & np.isfinite(presses.wrench).all(1) & (presses.wrench[:, 2] < 0) & (presses.depth > FLOOR * deepest)
    if known.sum() < FEWEST:
        raise BadCalibration(f'{known.sum()} presses with a recorded wrench are too few for a wrench map; {FEWEST} are needed')
    kept = np.flatnonzero(known)[np.unique(np.linspace(0, known.sum() - 1, min(MOST, known.sum())).astype(int))]
    keep = np.zeros(len(presses), bool)
    keep[kept] = True
    presses = presses.select(keep)
    return _Fit(presses, sensor).numbers() | ({} if method is None else _stiffness(presses, method))


def _stiffness(presses: Presses, method: TouchMethod) -> dict:
    """The factor of the wrenches that a method tells, and its errors at these presses; empty where it tells none."""
    found = [(touches[0].wrench, wrench) for touches, wrench in zip(map(method.estimate, presses.fields), presses.wrench)
             if len(touches) == 1 and np.isfinite(touches[0].wrench).all()]
    if len(found) < FEWEST:
        return {}
    told, truth = np.swapaxes(found, 0, 1)
    stiffness = float(np.median(truth[:, 2] / told[:, 2]))
    force, moment = (_relative(stiffness * told[:, part] - truth[:, part], truth[:, part]) for part in (slice(3), slice(3, 6)))
    return {'stiffness': stiffness, 'told': [1] * 6, 'held_out_force': force, 'held_out_moment': moment}


class _Features:
    """State and features of a touch. half: (2,) m, unit of places; width: m, of the neighbourhood of a tip."""

    def __init__(self, half, deepest: float, width: float, is_sheet: bool):
        self.half, self.deepest, self.width, self.is_sheet = np.array(half, float), deepest, width, is_sheet

    def __call__(self, field: MarkerField, place: np.ndarray, depth: float) -> tuple[np.ndarray, list[np.ndarray]]:
        """State (D,), and the features of each output; NaN where too few markers are seen around the tip."""
        away = np.exp(np.sum((field.rest - place[:2])**2, axis=1) / (-2 * self.width**2))
        away[~(field.seen & np.isfinite(away))] = 0.0
        weight = away.sum()
        dragged = away @ np.nan_to_num(field.shift) / weight if weight > 1 else np.full(2, np.nan)
        x, y = place[:2] / self.half
        a, b = dragged / max(depth, FLOOR * self.deepest)
        folded = (x * x, y * y) if self.is_sheet else (x * x + y * y,)
        along, across = np.array([x, a]), np.array([y, b])
        parts = [np.array([1.0, a * x + b * y, a * a + b * b]), along, across, across, along, np.array([x * y, x * b, y * a])]
        return np.array([*folded, np.sqrt(depth / self.deepest)]), parts


def _plain(depth: float) -> np.ndarray:
    """(6,) wrench about the tip with a normal force in proportion to depth."""
    return np.array([0.0, 0.0, -depth, 0.0, 0.0, 0.0])


class WrenchMap:
    """A fitted map. numbers: result of fit_wrench_map; model: method that tells the wrench of a touch which has none of its own, as by
    another method. Raises BadCalibration where something is missing."""

    def __init__(self, numbers: Mapping, model: TouchMethod | None = None):
        self._model = model
        try:
            self._features = _Features(numbers['half'], float(numbers['deepest']), float(numbers['width']), bool(numbers['is_sheet']))
            self._stiffness = float(numbers.get('stiffness', np.nan))
            self._scale, self._reported = float(numbers['scale']), np.array(numbers['told'], bool)
            self._states, self._lengths = np.array(numbers['states'], float), np.array(numbers['lengths'], float)
            duals = [np.array(dual, float) for dual in numbers['duals']]
            shapes = [dual.shape for dual in duals] + [self._lengths.shape, self._reported.shape]
            count, inputs = self._states.shape
            if shapes != [(count, features) for features in _FEATURES] + [(_PARTS, inputs), (_PARTS,)]:
                raise ValueError('shapes do not agree')
        except (KeyError, TypeError, ValueError, IndexError) as wrong:
            raise BadCalibration(f'the wrench map in the calibration file cannot be read ({wrong!r}); calibrate anew') from wrong
        self._part, self._dual = np.repeat(np.arange(_PARTS), _FEATURES), np.hstack(duals)
        self._starts = np.searchsorted(self._part, np.arange(_PARTS))
        self._widths = 1 / self._lengths**2

    def wrench(self, field: MarkerField, touch: TouchEstimate) -> np.ndarray:
        """(6,) N and N m at the sensor frame's origin, of a frame with this touch alone; NaN for an axis that the calibration did not
        excite, where too few markers are seen around the touch, and beyond BEYOND times the calibrated depth."""
        if np.isfinite(self._stiffness):
            told = self._told(field, touch)
            if np.isfinite(told).all():
                return self._stiffness * told
        if not 0 < touch.depth < BEYOND * self._features.deepest:
            return np.full(6, np.nan)
        place = np.asarray(touch.position, float)
        state, parts = self._features(field, place, touch.depth)
        near = np.exp(-0.5 * (self._states - state)**2 @ self._widths.T)
        factors = np.einsum('nf,nf->f', near[:, self._part], self._dual)
        outputs = np.add.reduceat(factors * np.concatenate(parts), self._starts)
        outputs[0] += self._scale
        wrench = _assembled(outputs, _plain(touch.depth), place)
        return np.where(self._reported, wrench, np.nan)

    def _told(self, field: MarkerField, touch: TouchEstimate) -> np.ndarray:
        """(6,) wrench over the stiffness: of the touch itself, else of the one touch that the model finds; NaN without."""
        if self._model is None or np.isfinite(touch.wrench).all():
            return touch.wrench
        found = self._model.estimate(field)
        return found[0].wrench if len(found) == 1 else np.full(6, np.nan)


def _outputs(wrench: np.ndarray, plain: np.ndarray, place: np.ndarray) -> np.ndarray:
    """(6,) outputs of the map: correction of the plain wrench to a wrench."""
    about = wrench[3:] - np.cross(place, wrench[:3])
    over, plainly = np.array([*wrench[:2], *about]) / wrench[2], np.array([*plain[:2], *plain[3:]]) / plain[2]
    return np.append(np.log(wrench[2] / plain[2]), over - plainly)


def _assembled(outputs: np.ndarray, plain: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The wrench (6,) at the origin from the outputs (6,) of the map."""
    normal = plain[2] * np.exp(outputs[0])
    way_x, way_y, *about = outputs[1:] * normal + np.array([*plain[:2], *plain[3:]]) / plain[2] * normal
    x, y, z = place
    return np.array([way_x, way_y, normal, y * normal - z * way_y + about[0], z * way_x - x * normal + about[1],
                     x * way_y - y * way_x + about[2]])


class _Fit:
    """A map fitted to presses, with its relative cross-validation errors of force and moment."""

    def __init__(self, presses: Presses, sensor: MarkerSensor):
        half = np.array(sensor.size) / 2 if sensor.is_sheet else np.full(2, sensor.rim_radius)
        self._features = _Features(half, float(presses.depth.max()), ABOUT * max(sensor.pitch), sensor.is_sheet)
        samples = [self._features(field, place, depth) for field, place, depth in zip(presses.fields, presses.position, presses.depth)]
        seen = np.array([np.isfinite(np.concatenate(parts)).all() for _, parts in samples])
        presses, samples = presses.select(seen), [row for row, good in zip(samples, seen) if good]
        if len(samples) < FEWEST:
            raise BadCalibration(f'markers around the tip are seen in only {len(samples)} presses; {FEWEST} are needed for a wrench map')
        self._states = np.array([state for state, _ in samples])
        plain = np.array([_plain(depth) for depth in presses.depth])
        apart = np.array([_outputs(*row) for row in zip(presses.wrench, plain, presses.position)])
        self._scale = float(np.median(apart[:, 0]))
        apart[:, 0] -= self._scale
        unsure = 1 + (SHALLOW * self._features.deepest / presses.depth)**2
        self._factors = [VaryingFactors(self._states, np.array([parts[k] for _, parts in samples]), apart[:, k], unsure)
                         for k in range(_PARTS)]
        self._judge(presses, plain, _mirror_groups(presses.position[:, :2], max(sensor.pitch)))

    def _judge(self, presses: Presses, plain: np.ndarray, groups: np.ndarray) -> None:
        held = np.stack([factors.left_out(groups) for factors in self._factors], axis=1)
        held[:, 0] += self._scale
        error = np.array([_assembled(*row) for row in zip(held, plain, presses.position)]) - presses.wrench
        spread, largest = presses.wrench.std(axis=0), np.repeat(np.abs(presses.wrench).reshape(-1, 2, 3).max(axis=(0, 2)), 3)
        self._reported = spread > EXCITED * largest
        self._reported[2] = True
        if len(np.unique(groups)) >= PLACES:
            self._reported &= np.mean(error**2, axis=0) < np.mean(presses.wrench**2, axis=0)
        self.force_error, self.moment_error = (_relative(error[:, part], presses.wrench[:, part])
                                               for part in (slice(3), slice(3, 6)))

    def numbers(self) -> dict:
        """For a calibration file."""
        return {'half': self._features.half.tolist(), 'deepest': self._features.deepest, 'width': self._features.width,
                'is_sheet': int(self._features.is_sheet), 'scale': self._scale, 'told': self._reported.astype(int).tolist(),
                'states': self._states.tolist(), 'lengths': [factors.lengths.tolist() for factors in self._factors],
                'duals': [factors.dual.tolist() for factors in self._factors],
                'held_out_force': self.force_error, 'held_out_moment': self.moment_error}


def _relative(error: np.ndarray, truth: np.ndarray) -> float:
    """Median relative error over the samples whose truth is at least 5 % of the largest."""
    size = np.linalg.norm(truth, axis=1)
    good = size > 0.05 * size.max()
    return float(np.median(np.linalg.norm(error[good], axis=1) / size[good])) if good.any() else float('nan')


def _mirror_groups(places: np.ndarray, pitch: float) -> np.ndarray:
    """(N,) group ids: places (N, 2) m in one square of a pitch share one, with their mirror images."""
    _, group = np.unique(np.round(np.abs(places) / pitch), axis=0, return_inverse=True)
    return group.ravel()

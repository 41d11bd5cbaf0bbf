# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the displacement field of any dot sensor to the wrench: a regularised map, fitted where the wrench was recorded.

A field is described by its moments: products of Legendre polynomials over the sensor up to the fifth degree (mean, divergence, curl, shear,
their first moments, and so on). Force over field size is a smooth function of these moments, scaled to size one, and of the size's log:
ridge regression with their products (a polynomial kernel), mirrored copies of every press added. How many products and how much ridge the
evidence (marginal likelihood) tells; what to expect at other places is told by places left out.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.polynomial.legendre import legvander

from ..errors import BadArgument, BadCalibration

DEGREE = 5
FEWEST = 6             # frames with touch that a map is fitted to, at the least
MOST = 300             # frames kept; of more, evenly spread ones
LEVEL = 0.2            # of the largest moment's spread: what varies less is not scaled up
POWERS, SPANS = (1, 2, 4), (1.0, 3.0, 8.0)  # degrees of products; e-foldings of size over which the map changes
RIDGES = 10.0 ** np.arange(-6, 0)
EXCITED = 0.05         # of the largest force or moment: an axis whose values spread less is refused
SEEN = 0.5             # of the dots: of fewer, no wrench is told
NEIGHBOURS = 12        # that a dot which is not seen is filled in from
PLACES = 6             # with fewer (mirror images counted once) those left out lie too far from the others to tell what an axis is worth
_ORDERS = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
_MIRRORS = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
_FEATURE_SIGNS = np.array([[(x**i * y**j) * side for i, j in _ORDERS for side in (x, y)] for x, y in _MIRRORS], float)
_SIX = np.array([(x, y, 1, y, x, x * y) for x, y in _MIRRORS], float)
_SIGNS = np.hstack([_SIX, _SIX[:, 3:]])


@dataclass(frozen=True)
class Frame:
    """Field places become the polynomials' arguments as (place - centre) / half, both (2,), in the field's unit."""

    centre: np.ndarray
    half: np.ndarray

    def moments(self, rest: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """(42,) coefficients of the polynomials that fit shift (K, 2) at rest (K, 2) best; NaN if fewer than SEEN of the dots are seen."""
        seen = np.isfinite(shift).all(1) & np.isfinite(rest).all(1)
        if seen.sum() < max(2 * len(_ORDERS), SEEN * len(seen)):
            return np.full(2 * len(_ORDERS), np.nan)
        shift = _filled(rest, shift, seen)
        seen = np.isfinite(shift).all(1)
        x, y = ((rest[seen] - self.centre) / self.half).T
        along, across = legvander(x, DEGREE), legvander(y, DEGREE)
        basis = np.stack([along[:, i] * across[:, j] for i, j in _ORDERS], axis=1)
        return np.linalg.lstsq(basis, shift[seen], rcond=None)[0].ravel()


def _filled(rest, shift, seen) -> np.ndarray:
    """shift, where a dot is not seen that of a paraboloid through its nearest neighbours, the nearer the more."""
    if seen.all():
        return shift
    shift, known = shift.copy(), np.flatnonzero(seen)
    for k in np.flatnonzero(~seen & np.isfinite(rest).all(1)):
        off = rest[known] - rest[k]
        near = np.argsort(np.sum(off**2, axis=1))[:NEIGHBOURS]
        x, y = off[near].T / np.abs(off[near]).max()
        weight = np.exp(-(x**2 + y**2))[:, None]
        powers = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        shift[k] = np.linalg.lstsq(powers * weight, shift[known[near]] * weight, rcond=1e-3)[0][0]
    return shift


class WrenchMap:
    """A fitted map. numbers: as fit_wrench_map makes them. Raises BadCalibration where something is missing."""

    def __init__(self, numbers: Mapping):
        try:
            self._frame = Frame(np.array(numbers['centre'], float), np.array(numbers['half'], float))
            self._scale, self._base = np.array(numbers['scale'], float), np.array(numbers['directions'], float)
            self._size, self._dual = np.array(numbers['sizes'], float), np.array(numbers['weights'], float)
            self._power, self._span = float(numbers['power']), float(numbers['span'])
            self._told, self._surer = np.array(numbers['told'], bool), np.array(numbers['surer_about_place'], bool)
            self._base = self._base.reshape(-1, len(self._scale))
            if self._dual.shape != (len(self._base), 9) or self._told.shape != (9,) or len(self._scale) != 2 * len(_ORDERS):
                raise ValueError('shapes do not agree')
        except (KeyError, TypeError, ValueError) as wrong:
            raise BadCalibration(f'the wrench map cannot be read from the calibration ({wrong!r}); calibrate anew') from wrong
        self._all = (self._base[None] * _FEATURE_SIGNS[:, None]).reshape(-1, self._base.shape[1])
        self._all_sizes, self._all_dual = np.tile(self._size, 4), (self._dual[None] * _SIGNS[:, None]).reshape(-1, 9)

    def wrench(self, rest: np.ndarray, shift: np.ndarray, place: np.ndarray | None = None) -> np.ndarray:
        """Wrench (6,), N and N m about the sensor's origin, of one field; NaN for an axis that the calibration did not excite.

        rest, shift: (K, 2) in the unit of the calibration, NaN where a dot is not seen. place: (3,) m, where the only touch stands; the
        moment is then told as the force's there and what is left over, about those axes where that proved surer.
        """
        moments = self._frame.moments(np.asarray(rest, float), np.asarray(shift, float)) / self._scale
        size = np.linalg.norm(moments)
        if not size > 0:
            return np.where(self._told[:6], size, np.nan)
        near = np.clip(np.log(size), self._size.min(), self._size.max())
        kernel = _kernel(moments[None] / size, np.array([near]), self._all, self._all_sizes, self._power, self._span)
        told = size * (kernel @ self._all_dual)[0]
        told[~self._told] = np.nan
        force, moment = told[:3], told[3:6]
        if place is not None and np.isfinite(place).all():
            about = np.cross(place, force) + told[6:]
            moment = np.where(self._surer & np.isfinite(about), about, moment)
        return np.concatenate([force, moment])


def fit_wrench_map(rest: np.ndarray, shifts: np.ndarray, wrenches: np.ndarray, places: np.ndarray) -> dict:
    """Numbers of a map, fitted to M frames with touch.

    rest: (K, 2) untouched places of the dots, in px or m; shifts: (M, K, 2) in the same unit, NaN where not seen; wrenches: (M, 6) N and
    N m; places: (M, 3) m, where the tool stood. Among the numbers: held_out_force and held_out_moment, median relative errors at places
    left out with their mirror images; told: which of the six axes (then of the moment about the place) are told. Raises BadArgument for
    shapes that disagree, BadCalibration for too few frames.
    """
    rest, shifts, wrenches, places = (np.asarray(values, float) for values in (rest, shifts, wrenches, places))
    if shifts.shape[1:] != rest.shape or wrenches.shape != (len(shifts), 6) or places.shape != (len(shifts), 3):
        shapes = [values.shape for values in (rest, shifts, wrenches, places)]
        raise BadArgument(f'wrench map: shapes of rest, shifts, wrenches and places disagree: {shapes}')
    frame = Frame(np.nanmean(rest, axis=0), np.nanmax(np.abs(rest - np.nanmean(rest, axis=0)), axis=0))
    moments = np.array([frame.moments(rest, shift) for shift in shifts]).reshape(len(shifts), -1)
    known = np.isfinite(moments).all(1) & np.isfinite(wrenches).all(1) & np.isfinite(places).all(1) & np.any(moments != 0, axis=1)
    if known.sum() < FEWEST:
        raise BadCalibration(f'{known.sum()} frames with touch and a recorded wrench are too few for a wrench map; {FEWEST} are needed')
    kept = np.flatnonzero(known)[np.unique(np.linspace(0, known.sum() - 1, min(MOST, known.sum())).astype(int))]
    spread = np.sqrt(np.mean(moments[kept]**2, axis=0))
    scale = np.sqrt(np.maximum(spread, LEVEL * spread.max()))
    nine = np.hstack([wrenches[kept], wrenches[kept, 3:] - np.cross(places[kept], wrenches[kept, :3])])
    return _Fit(moments[kept] / scale, nine, places[kept]).numbers() | {
        'centre': frame.centre.tolist(), 'half': frame.half.tolist(), 'scale': scale.tolist()}


class _Fit:
    """moments (N, F), scaled; wrench (N, 9); places (N, 3) m."""

    def __init__(self, moments, wrench, places):
        self.size = np.linalg.norm(moments, axis=1)
        self.directions, self.logs, self.wrench = moments / self.size[:, None], np.log(self.size), wrench
        self.places, self.groups = places, _mirror_groups(places)
        self.target = wrench / self.size[:, None]
        self.target_scale = np.maximum(np.sqrt(np.mean(self.target**2, axis=0)), 1e-12)
        self.power, self.span, self.ridge = max(product(POWERS, SPANS, RIDGES), key=lambda way: self._evidence(*way))

    def numbers(self) -> dict:
        held = self._held_out()
        about = held[:, 6:] + self.wrench[:, 3:6] - self.wrench[:, 6:] + np.cross(self.places, held[:, :3] - self.wrench[:, :3])
        raw, by_place = (np.mean((told - self.wrench[:, 3:6])**2, axis=0) for told in (held[:, 3:6], about))
        whole = self._solve(np.ones(len(self.size), bool))
        force, moment = (_relative(held[:, part] - self.wrench[:, part], self.wrench[:, part]) for part in (slice(3), slice(3, 6)))
        return {'directions': self.directions.tolist(), 'sizes': self.logs.tolist(), 'weights': whole.tolist(), 'power': self.power,
                'span': self.span, 'ridge': float(self.ridge), 'told': self._told(held).astype(int).tolist(),
                'surer_about_place': (~(by_place > raw)).astype(int).tolist(), 'held_out_force': force,
                'held_out_moment': moment}

    def _copies(self, keep):
        directions = (self.directions[keep][None] * _FEATURE_SIGNS[:, None]).reshape(-1, self.directions.shape[1])
        return directions, np.tile(self.logs[keep], 4), (self.target[keep][None] * _SIGNS[:, None]).reshape(-1, 9)

    def _evidence(self, power, span, ridge) -> float:
        directions, logs, target = self._copies(slice(None))
        lower = np.linalg.cholesky(_kernel(directions, logs, directions, logs, power, span) + ridge * np.eye(len(logs)))
        white = np.linalg.solve(lower, (target / self.target_scale)[:, :6][:, self._lively()[:6]])
        return float(-len(logs) / 2 * np.log(np.mean(white**2, axis=0)).sum() - white.shape[1] * np.log(np.diag(lower)).sum())

    def _solve(self, keep) -> np.ndarray:
        """Dual weights (N, 9) of the presses kept; those of their mirrored copies are the same but for signs."""
        directions, logs, target = self._copies(keep)
        kernel = _kernel(directions, logs, directions, logs, self.power, self.span) + self.ridge * np.eye(len(logs))
        return np.linalg.solve(kernel, target)[:len(logs) // 4]

    def _held_out(self) -> np.ndarray:
        told = np.full_like(self.wrench, np.nan)
        for group in np.unique(self.groups):
            held = self.groups == group
            if held.all():
                break
            directions, logs, _ = self._copies(~held)
            dual = (self._solve(~held)[None] * _SIGNS[:, None]).reshape(-1, 9)
            kernel = _kernel(self.directions[held], self.logs[held], directions, logs, self.power, self.span)
            told[held] = self.size[held, None] * (kernel @ dual)
        return told

    def _lively(self) -> np.ndarray:
        """(9,) which axes spread enough; the moment about the place is as lively as its axis."""
        spread = self.wrench.std(axis=0)
        largest = np.abs(self.wrench).max(axis=0)
        limit = EXCITED * np.repeat([largest[:3].max(), largest[3:6].max(), 0.0], 3)
        lively = spread > limit
        lively[6:] = lively[3:6]
        return lively if lively.any() else np.ones(9, bool)

    def _told(self, held) -> np.ndarray:
        if len(np.unique(self.groups)) < PLACES:
            return self._lively()
        return self._lively() & (np.mean((held - self.wrench)**2, axis=0) < np.maximum(np.mean(self.wrench**2, axis=0), 1e-300))


def _kernel(directions, logs, others, other_logs, power, span) -> np.ndarray:
    near = np.exp(-0.5 * ((logs[:, None] - other_logs) / span)**2)
    return near * np.abs((1 + directions @ others.T) / 2)**power


def _relative(error: np.ndarray, truth: np.ndarray) -> float:
    size = np.linalg.norm(truth, axis=1)
    good = np.isfinite(error).all(1) & (size > EXCITED * size.max())
    return float(np.median(np.linalg.norm(error[good], axis=1) / size[good])) if good.any() else float('nan')


def _mirror_groups(places: np.ndarray) -> np.ndarray:
    _, group = np.unique(np.round(np.abs(places[:, :2]), 3), axis=0, return_inverse=True)
    return group.ravel()

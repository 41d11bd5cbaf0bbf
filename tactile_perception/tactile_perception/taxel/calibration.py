# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fits the response of a taxel array, pressure against value, and the loop of its sensing layer to known normal loads."""
from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from .._core.taxel import Hysteresis
from ..errors import BadCalibration
from .pressure import TaxelArray
from .response import MOST_HELD, Loop, Response, followed

_PARTS = 3  # folds of the cross-validation
_LIGHT = 0.3  # of the largest force, added to each in the weights of the loop's fit, as in fit_response
# Tried in the fit: reaches, of the largest load, and of each load; s: a layer that comes back through less than the whole range
# shows its reach.
_REACHES = (0.0, 0.005, *np.geomspace(0.01, 0.32, 8).tolist())
_RELATIVE = (0.0, 0.04, 0.08, 0.16, 0.32)
_RELAXATIONS = np.geomspace(0.1, 10, 5).tolist()
_LATE_S = (0.1, 0.4, 1.6, 6.4, 25.6)  # s, after which parts of a load are shown: what lies between is a sum of two of them
_FARTHEST = 0.5  # of the largest load, up to which both reaches together are tried: farther, it is not seen on the way back
_BETTER = 0.7  # of the residuals without a loop, below which those with one must be: noise alone gains a few percent
# Of the residuals without late parts, below which those with them must be: a hard loop that is not quite that of the layer looks
# like a softer one with a little that is late.
_SLOWER = 0.5
_RESTED_S = 1e6  # s, before the first load
_KNEE = 0.05  # of the largest calibrated change, below which pressure may rise faster (a sensor with a dead zone).
_FEWEST = 3  # loads: one for each coefficient of the curve
_SMALL = 0.3  # of the largest force, added to each force in the weights: relative error of large forces, absolute of small ones.
_REACHED = 0.95  # part of the taxels that an even load must reach.
_RESPONDING = 0.3  # of the mean change, from which a taxel is reached: below the least gain
_LOADED = 0.05  # of the largest mean change, from which a frame is used for gains.
_GAINS = (0.5, 2.0)  # plausible range; a taxel outside it keeps gain 1.


@dataclass
class Loads:
    """Mean frame under each load, and after it, in their order.

    changes: (N, rows, columns), less the untouched frame; forces: (N,) N, 0 after a load; zero: untouched frame (rows, columns) or None;
    left_out: one line per unusable frame; when: recording and time of each load; times: (N,) s; bags: (N,) number of the recording;
    levels: (N,) number of the stretch of equal loads that it belongs to.
    """

    changes: np.ndarray
    forces: np.ndarray
    zero: np.ndarray | None
    left_out: list[str]
    when: list[str]
    times: np.ndarray
    bags: np.ndarray
    levels: np.ndarray


def fit_loop(times: np.ndarray, loads: np.ndarray, terms: np.ndarray, weights: np.ndarray) -> Loop:
    """The loop by loads (N,), Pa, at times (N,) s in their order, some of them rising and some falling, and none after them.

    terms: (N, K), nonnegative combinations of which are what the layer shows; weights: (N,) of the residuals, 0 to leave one out. No loop
    where one does not explain the loads much better than none. What the layer shows late and what it holds add up to the load: for a
    reach and a relaxation, nonnegative least squares give all shares.
    """
    from scipy.optimize import nnls  # calibration alone needs it
    intervals, most = np.diff(times, prepend=times[0] - _RESTED_S), float(loads.max())
    lasts = [time for time in _LATE_S if time <= intervals[intervals < 0.5 * _RESTED_S].sum()]
    terms = terms / np.maximum(np.abs(terms).max(axis=0), 1e-300)

    loops = [Loop(0.0, most * reach, relative, relaxation) for reach, relative, relaxation in product(_REACHES, _RELATIVE, _RELAXATIONS)
             if 0 < reach + relative <= _FARTHEST]
    held_back = [loads - loop.held(loads, intervals) for loop in loops]

    def fitted(hidden: list[np.ndarray]) -> tuple[np.ndarray, float]:
        """Shares of what is hidden, and the residual."""
        parts, left = nnls(np.column_stack([terms, *hidden]) * weights[:, None], loads * weights)
        return parts[terms.shape[1]:], left

    def best(late_s: list[float]) -> tuple[float, Loop]:
        """The least residual with parts that are shown after late_s, s, and its loop."""
        least, found = np.inf, Loop()
        late = [loads - followed(loads, intervals, time) for time in late_s]
        for loop, hidden in zip(loops, held_back):
            parts, left = fitted([*late, hidden])
            slow = parts[:-1]
            if left < least and parts.sum() <= MOST_HELD:
                least, found = left, replace(loop, share=float(parts[-1] / (1 - slow.sum())), late=tuple(slow[slow > 0].tolist()),
                                             late_s=tuple(np.array(late_s)[slow > 0].tolist()))
        return least, found

    none, (least, loop), (with_late, late_loop) = fitted([])[1], best([]), best(lasts)
    if with_late < _SLOWER * least:
        least, loop = with_late, late_loop
    return loop if least < _BETTER * none else Loop()


def _curve_terms(value: np.ndarray, knee: float) -> np.ndarray:
    """(3, ...) terms that scale multiplies."""
    size = np.abs(value)
    return np.stack([value, value * size, value * knee / (size + knee)])


def fit_gains(changes: np.ndarray) -> np.ndarray | None:
    """Gains (rows, columns), mean about 1, from changes (N, rows, columns) under even loads; None with fewer than 3 even loads."""
    mean = changes.mean(axis=(1, 2))
    even = mean > _LOADED * max(float(mean.max(initial=0.0)), 1e-9)
    spread = (changes > _RESPONDING * mean[:, None, None]).mean(axis=(1, 2))
    even &= spread > _REACHED
    if even.sum() < _FEWEST:
        return None
    gains = np.einsum('n,nij->ij', mean[even], changes[even]) / np.sum(mean[even]**2)
    return np.where((gains > _GAINS[0]) & (gains < _GAINS[1]), gains, 1.0).astype(np.float32)


def force_terms(changes: np.ndarray, taxel_area: float, gain: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """What scale multiplies in the forces (N,) of changes (N, rows, columns), (N, 3), and the curve's knee; see fit_response."""
    value = (changes if gain is None else changes / gain).reshape(len(changes), -1).astype(float)
    knee = _KNEE * float(value.max(initial=0))
    return taxel_area * _curve_terms(value, max(knee, 1e-12)).sum(axis=2).T, knee


def fit_response(changes: np.ndarray, forces: np.ndarray, taxel_area: float,
                 gain: np.ndarray | None = None) -> tuple[Response, np.ndarray]:
    """Nonnegative least squares fit of the response to normal forces (N,), N, with changes (N, rows, columns), and its predictions (N,), N.

    taxel_area: m^2; gain: (rows, columns). Forces that are NaN or not positive are skipped. Raises BadCalibration where the loads do not
    determine the response.
    """
    forces = np.asarray(forces, float)
    known = np.isfinite(forces) & (forces > 0)
    if np.unique(np.round(forces[known], 6)).size < _FEWEST:
        raise BadCalibration(f'normal force: {np.unique(np.round(forces[known], 6)).size} different loads; at least {_FEWEST} are needed')
    rows, knee = force_terms(changes, taxel_area, gain)
    if not (rows[known, 0] > 0).all():
        raise BadCalibration('normal force: the sensor does not respond to some of the loads')
    unit = rows[known].mean(axis=0)
    weight = forces[known] + _SMALL * forces[known].max()
    from scipy.optimize import nnls  # calibration alone needs it
    scale = nnls(rows[known] / unit / weight[:, None], forces[known] / weight)[0] / unit
    return Response(tuple(float(s) for s in scale), knee, gain, True), rows @ scale


def loaded_areas(loads: Loads, taxel_area: float) -> np.ndarray:
    """(N,) m^2 under each load: that of even pressure with the same sum and sum of squares of changes; after a load, as under it."""
    flat = np.maximum(loads.changes, 0).reshape(len(loads.changes), -1)
    areas = taxel_area * flat.sum(axis=1)**2 / np.maximum((flat**2).sum(axis=1), 1e-12)
    return areas[np.maximum.accumulate(np.where(loads.forces == 0, 0, np.arange(len(areas))))]


def find_loop(loads: Loads, array: TaxelArray, gain: np.ndarray | None) -> tuple[Loop, np.ndarray]:
    """The loop between rising and falling loads, and (N,) N, what of each load the sensor shows, NaN after it. Times between
    recordings count as rest."""
    areas = loaded_areas(loads, array.taxel_area)
    terms = force_terms(loads.changes, array.taxel_area, gain)[0] / areas[:, None]
    weights = areas / (loads.forces + _LIGHT * loads.forces.max())
    times = _rested(loads)
    loop = fit_loop(times, loads.forces / areas, terms, weights)
    shown = loop.shown(loads.forces / areas, np.diff(times, prepend=times[0] - 1e6)) * areas
    return loop, np.where(loads.forces > 0, shown, np.nan)


def _rested(loads: Loads) -> np.ndarray:
    """(N,) s, times of the loads, with a rest between recordings."""
    return loads.times - loads.times.min() + 1e6 * loads.bags


def held_out_errors(loads: Loads, array: TaxelArray, gain: np.ndarray | None, loop: Loop, shown: np.ndarray) -> np.ndarray:
    """Cross-validation errors (N,) of the forces, relative, with the loop undone; NaN after loads, and where other folds do not
    determine the response.

    loop, shown: see find_loop.
    """
    seen, held_out = np.full(len(loads.forces), np.nan), loads.levels % _PARTS
    areas, times = loaded_areas(loads, array.taxel_area), _rested(loads)
    for part in range(_PARTS):
        out = held_out == part
        try:
            response, _ = fit_response(loads.changes[~out], shown[~out], array.taxel_area, gain)
        except BadCalibration:
            continue
        seen[out] = [response.pressure(change).sum() * array.taxel_area for change in loads.changes[out]]
    forces = np.where(loads.forces > 0, loads.forces, np.nan)
    if loop.is_none or np.isnan(seen).any():
        return seen / forces - 1
    undo, found = Hysteresis(loop), []
    undo.undone(np.zeros((1, 1), np.float32), 0.0)
    for pressure, interval in zip(seen / areas, np.diff(times, prepend=times[0])):
        found.append(float(undo.undone(np.full((1, 1), pressure, np.float32), float(interval))[0, 0]))
    return np.array(found) * areas / forces - 1


def calibrated_response(loads: Loads, array: TaxelArray, gain: np.ndarray | None, loop: Loop, shown: np.ndarray) -> Response:
    """The response to loads, with the loop and the untouched values. loop, shown: see find_loop."""
    response, _ = fit_response(loads.changes, shown, array.taxel_area, gain)
    return replace(response, loop=loop, zero=None if loads.zero is None else np.float32(loads.zero))

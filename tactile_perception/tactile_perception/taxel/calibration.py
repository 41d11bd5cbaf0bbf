# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fits the response of a taxel array, pressure against value, and the loop of its sensing layer to known normal loads."""
from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from .._core.taxel import Hysteresis
from ..core.errors import BadCalibration
from .constants import TAXEL
from .pressure import TaxelArray
from .response import Loop, Response, followed

# Grid of the fit: reaches over the largest load, reaches over each load, and relaxation times, s. A layer that is unloaded through less
# than the whole range shows its reach.
# Of the residual without late parts, for late parts to be accepted: a hard loop that differs a little from that of the layer resembles a
# softer one with a small late part.
_UNLOADED_S = 1e6  # s, before the first load


@dataclass
class Loads:
    """Mean frames under N loads and after them, in temporal order.

    Attributes
    ----------
    changes : ndarray, shape (N, rows, columns)
        Values minus the untouched frame.
    forces : ndarray, shape (N,)
        Normal forces in N; 0 after a load.
    zero : ndarray, shape (rows, columns), or None
        Untouched frame; None if none was recorded.
    left_out : list of str
        One line for each unusable frame.
    when : list of str
        Recording and time of each load.
    times : ndarray, shape (N,)
        Times in s.
    bags, levels : ndarray, shape (N,)
        Number of the recording, and of the interval of equal loads, that each load belongs to.
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
    """Fit the hysteresis loop to loads (N,), Pa, at times (N,), s, in temporal order, with rising and falling loads.

    terms: (N, K), whose nonnegative combinations are the shown pressure; weights: (N,), of the residuals, 0 to leave one out. The result is
    no loop unless a loop explains the loads much better. The shown, the late and the held part add up to the load: for given reaches and
    relaxation, nonnegative least squares give all shares.
    """
    from scipy.optimize import nnls  # calibration alone needs it
    intervals, largest = np.diff(times, prepend=times[0] - _UNLOADED_S), float(loads.max())
    # s, delays of the late parts; a delay in between is a sum of two of them
    delays = [time for time in (0.1, 0.4, 1.6, 6.4, 25.6) if time <= intervals[intervals < 0.5 * _UNLOADED_S].sum()]
    terms = terms / np.maximum(np.abs(terms).max(axis=0), 1e-300)

    # Grid: reaches over the largest load, over each load, and relaxation times, s. Unloading through a part of the range shows the reach.
    grid = product((0.0, 0.005, *np.geomspace(0.01, 0.32, 8).tolist()), (0.0, 0.04, 0.08, 0.16, 0.32), np.geomspace(0.1, 10, 5).tolist())
    loops = [Loop(0.0, largest * reach, relative, relaxation) for reach, relative, relaxation in grid
             if 0 < reach + relative <= TAXEL.max_reach]
    held_back = [loads - loop.held(loads, intervals) for loop in loops]

    def fitted(hidden: list[np.ndarray]) -> tuple[np.ndarray, float]:
        """Shares of the hidden parts, and the residual."""
        parts, residual = nnls(np.column_stack([terms, *hidden]) * weights[:, None], loads * weights)
        return parts[terms.shape[1]:], residual

    def best(late_s: list[float]) -> tuple[float, Loop]:
        """Find the smallest residual with late parts of these delays, s, and its loop."""
        smallest, found = np.inf, Loop()
        late = [loads - followed(loads, intervals, time) for time in late_s]
        for loop, hidden in zip(loops, held_back):
            parts, residual = fitted([*late, hidden])
            slow = parts[:-1]
            if residual < smallest and parts.sum() <= TAXEL.max_hidden:
                smallest = residual
                found = replace(loop, share=float(parts[-1] / (1 - slow.sum())), late=tuple(slow[slow > 0].tolist()),
                                late_s=tuple(np.array(late_s)[slow > 0].tolist()))
        return smallest, found

    without_loop, (residual, loop), (late_residual, late_loop) = fitted([])[1], best([]), best(delays)
    if late_residual < TAXEL.max_late_residual * residual:
        residual, loop = late_residual, late_loop
    return loop if residual < TAXEL.max_loop_residual * without_loop else Loop()


def _curve_terms(value: np.ndarray, knee: float) -> np.ndarray:
    """Compute the terms (3, ...) of the response curve, which scale multiplies."""
    size = np.abs(value)
    return np.stack([value, value * size, value * knee / (size + knee)])


def fit_gains(changes: np.ndarray) -> np.ndarray | None:
    """Fit gains (rows, columns), mean about 1, to changes (N, rows, columns) under even loads; None with fewer than 3 even loads."""
    mean = changes.mean(axis=(1, 2))
    even = mean > TAXEL.min_load * max(float(mean.max(initial=0.0)), 1e-9)
    spread = (changes > TAXEL.min_response * mean[:, None, None]).mean(axis=(1, 2))
    even &= spread > TAXEL.min_coverage
    if even.sum() < TAXEL.min_loads:
        return None
    gains = np.einsum('n,nij->ij', mean[even], changes[even]) / np.sum(mean[even]**2)
    return np.where((gains > TAXEL.gain_range[0]) & (gains < TAXEL.gain_range[1]), gains, 1.0).astype(np.float32)


def force_terms(changes: np.ndarray, taxel_area: float, gain: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Terms (N, 3), which scale multiplies, of the forces under changes (N, rows, columns), and the knee of the curve."""
    value = (changes if gain is None else changes / gain).reshape(len(changes), -1).astype(float)
    knee = TAXEL.knee * float(value.max(initial=0))
    return taxel_area * _curve_terms(value, max(knee, 1e-12)).sum(axis=2).T, knee


def fit_response(changes: np.ndarray, forces: np.ndarray, taxel_area: float,
                 gain: np.ndarray | None = None) -> tuple[Response, np.ndarray]:
    """Fit the response to normal forces (N,), N, by nonnegative least squares, and predict them (N,), N.

    changes: (N, rows, columns); taxel_area: m^2; gain: (rows, columns). Forces that are NaN or not positive are skipped. Raises
    BadCalibration if the loads do not determine the response.
    """
    forces = np.asarray(forces, float)
    known = np.isfinite(forces) & (forces > 0)
    if np.unique(np.round(forces[known], 6)).size < TAXEL.min_loads:
        raise BadCalibration(f'normal force: {np.unique(np.round(forces[known], 6)).size} different loads, at least {TAXEL.min_loads} '
                             'needed')
    rows, knee = force_terms(changes, taxel_area, gain)
    if not (rows[known, 0] > 0).all():
        raise BadCalibration('normal force: the sensor does not respond to some of the loads')
    unit = rows[known].mean(axis=0)
    weight = forces[known] + TAXEL.weight_floor * forces[known].max()
    from scipy.optimize import nnls  # calibration alone needs it
    scale = nnls(rows[known] / unit / weight[:, None], forces[known] / weight)[0] / unit
    return Response(tuple(float(s) for s in scale), knee, gain, True), rows @ scale


def loaded_areas(loads: Loads, taxel_area: float) -> np.ndarray:
    """Area (N,), m^2, under each load: that of even pressure with the same sum and sum of squares; after a load, as under it."""
    flat = np.maximum(loads.changes, 0).reshape(len(loads.changes), -1)
    areas = taxel_area * flat.sum(axis=1)**2 / np.maximum((flat**2).sum(axis=1), 1e-12)
    return areas[np.maximum.accumulate(np.where(loads.forces == 0, 0, np.arange(len(areas))))]


def find_loop(loads: Loads, array: TaxelArray, gain: np.ndarray | None) -> tuple[Loop, np.ndarray]:
    """Fit the loop between rising and falling loads, and compute the part (N,), N, of each load that the sensor shows; NaN after a load.

    The sensor is taken as unloaded between recordings.
    """
    areas = loaded_areas(loads, array.taxel_area)
    terms = force_terms(loads.changes, array.taxel_area, gain)[0] / areas[:, None]
    weights = areas / (loads.forces + TAXEL.weight_floor * loads.forces.max())
    times = _separated_times(loads)
    loop = fit_loop(times, loads.forces / areas, terms, weights)
    shown = loop.shown(loads.forces / areas, np.diff(times, prepend=times[0] - _UNLOADED_S)) * areas
    return loop, np.where(loads.forces > 0, shown, np.nan)


def _separated_times(loads: Loads) -> np.ndarray:
    """Take the times (N,), s, of the loads, with unloaded time between recordings."""
    return loads.times - loads.times.min() + _UNLOADED_S * loads.bags


def held_out_errors(loads: Loads, array: TaxelArray, gain: np.ndarray | None, loop: Loop, shown: np.ndarray) -> np.ndarray:
    """Relative cross-validation errors (N,) of the forces, with the loop compensated.

    NaN after loads, and where the other folds do not determine the response. loop, shown: from find_loop.
    """
    seen, held_out = np.full(len(loads.forces), np.nan), loads.levels % 3  # of the cross-validation
    areas, times = loaded_areas(loads, array.taxel_area), _separated_times(loads)
    for part in range(3):
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
    """Fit the response to loads, with the loop and the untouched values. loop, shown: from find_loop."""
    response, _ = fit_response(loads.changes, shown, array.taxel_area, gain)
    return replace(response, loop=loop, zero=None if loads.zero is None else np.float32(loads.zero))

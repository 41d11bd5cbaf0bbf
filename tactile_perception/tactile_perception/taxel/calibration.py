# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a taxel array: fits its response, pressure against value, and the loop of its layer to recordings of known normal loads
(ground_truth/wrench)."""
from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from tactile_driver.nodes.messages.images import grey_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from .parameters import TAXEL_PARAMETERS, taxel_array
from .pressure import TaxelArray, fill
from .response import MOST_HELD, Hysteresis, Loop, Response, followed, write_taxels
from ..bags.stamped import TRUE_WRENCH, find_prefix
from ..calibration.files.format import Specimen
from ..calibration.residuals import Residuals, outliers, report_residuals
from ..common.progress import Progress
from ..errors import BadCalibration, BadFrame
from ..nodes.messages import conversions as convert
from ..parameters.file import read_parameters

_SAME = 0.02  # relative difference below which loads count as equal
_LONGEST_S = 0.1  # equal loads that last longer are several, since what the sensor shows creeps
_PARTS = 3  # folds of the cross-validation
_LIGHT = 0.3  # of the largest force, added to each in the weights of the loop's fit, as in fit_response
_ZERO = 1e-3  # N, smaller forces count as untouched
_AFTER_S = 30.0  # s after a load, in which what is left of it is fitted, too: later it no longer changes
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


def read_loads(bags: list[Path], array: TaxelArray, dead: np.ndarray, namespace: str) -> Loads:
    """The loads in bags. Raises TactileError for bags without images or wrenches."""
    stretches, untouched, left_out, level = [], [], [], -1
    for number, bag in enumerate(bags):
        last = loaded = None
        for stamp, values, force in _frames(bag, array, namespace, left_out):
            if not np.isfinite(force):
                last = None
            elif force < _ZERO and loaded is None:
                untouched.append(values)
            elif force >= _ZERO or stamp - loaded < _AFTER_S:  # after a load the sensor may still show some of it
                force, loaded = (force, stamp) if force >= _ZERO else (0.0, loaded)
                if last is None or abs(force - last) > _SAME * last:
                    last, level, begin = force, level + 1, None
                if begin is None or stamp - begin > _LONGEST_S:
                    begin = stamp
                    stretches.append(([], [], last, f'{bag.name} at {stamp:.3f} s', number, level))
                stretches[-1][0].append(values)
                stretches[-1][1].append(stamp)
    if not any(one[2] for one in stretches):
        raise BadCalibration('no frame with a normal load in the recordings; ground_truth/wrench must contain it (force.z < 0)')
    zero = np.mean(untouched, axis=0, dtype=float) if untouched else None
    if zero is None:  # what is left of a load is unknown
        stretches = [one for one in stretches if one[2]]
    values, stamps, forces, when, numbers, levels = zip(*stretches)
    pictures = np.array([np.mean(one, axis=0, dtype=float) for one in values]) - (0 if zero is None else zero)
    pictures = np.array([fill(picture.astype(np.float32), dead) for picture in pictures])
    return Loads(pictures, np.array(forces), zero, left_out, list(when), np.array([np.mean(one) for one in stamps]), np.array(numbers),
                 np.array(levels))


def _frames(bag: Path, array: TaxelArray, namespace: str, left_out: list[str]):
    """Yield (stamp s, values, normal force N) of each frame; NaN for an unknown force."""
    waiting = None
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace)
        if prefix + TRUE_WRENCH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUE_WRENCH}: calibration needs the normal force')
        for raw in Progress(reader.messages({prefix + 'image_raw', prefix + TRUE_WRENCH}), f'messages of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            stamp = convert.stamp_seconds(message.header)
            if raw.topic == prefix + 'image_raw':
                if waiting is not None:
                    yield *waiting, np.nan
                try:
                    waiting = stamp, array.frame(grey_to_array(message, 'taxel image'))
                except BadFrame as error:
                    left_out.append(f'{bag.name} at {stamp:.3f} s: {error}')
                    waiting = None
            elif waiting is not None and waiting[0] == stamp:
                yield *waiting, -float(message.wrench.force.z)
                waiting = None


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


def curve_terms(value: np.ndarray, knee: float) -> np.ndarray:
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
    return taxel_area * curve_terms(value, max(knee, 1e-12)).sum(axis=2).T, knee


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


def calibrate_taxels(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit, write output and the plot of the residuals beside it, and return a report; serial: of the device.

    Raises TactileError for recordings that cannot determine the response.
    """
    values = read_parameters(params, 'taxel_contact_node', TAXEL_PARAMETERS)
    array = taxel_array(values)
    loads = read_loads(bags, array, array.dead([n for n in values['dead_taxels'] if n >= 0]), namespace)
    gain = fit_gains(loads.changes)
    loop, shown = find_loop(loads, array, gain)
    response = calibrated_response(loads, array, gain, loop, shown)
    errors = held_out_errors(loads, array, gain, loop, shown)
    residuals = {'held_out_force_mean': float(np.nanmean(np.abs(errors))) if np.isfinite(errors).any() else float('nan'),
                 'held_out_force_largest': float(np.nanmax(np.abs(errors))) if np.isfinite(errors).any() else float('nan')}
    pressed = loads.forces[loads.forces > 0]
    span = {'force': [float(pressed.min()), float(pressed.max())]}
    most = float(np.max(loads.forces / loaded_areas(loads, array.taxel_area)))
    held_out = held_out_residuals(loads, array, errors)
    standing_out = outliers(held_out[:1])
    write_taxels(output, response, residuals, span, loads.left_out, Specimen(serial, values), standing_out)
    shown = [*held_out, *_gains(response, array)]
    return '\n'.join([report(loads, response, residuals, output, most), *report_residuals(shown, standing_out, output, 'taxel array')])


def held_out_residuals(loads: Loads, array: TaxelArray, errors: np.ndarray) -> list[Residuals]:
    """Cross-validation error of each load's force over the force, and over the pad if the loads are at several positions.

    errors: (N,) relative.
    """
    pressed = np.flatnonzero(loads.forces)
    percent, when = 100 * errors[pressed], [loads.when[k] for k in pressed]
    found = [Residuals('force', '%', percent, np.stack([loads.forces[pressed], percent], axis=1), ('force (N)', 'error (% of it)'), when)]
    weight = np.maximum(loads.changes[pressed], 0).reshape(len(pressed), -1)
    x, y = (1e3 * grid.ravel() for grid in np.meshgrid(array.x, array.y))
    middle = np.stack([weight @ x, weight @ y], axis=1) / np.maximum(weight.sum(axis=1), 1e-12)[:, None]
    if np.ptp(middle, axis=0).max() > 1e3 * array.pitch:
        found.append(Residuals('force at its place', '%', percent, middle, ('x (mm)', 'y (mm)'), when))
    return found


def _gains(response: Response, array: TaxelArray) -> list[Residuals]:
    """Deviation of each taxel's gain from 1, for the plot."""
    if response.gain is None:
        return []
    x, y = (1e3 * grid.ravel() for grid in np.meshgrid(array.x, array.y))
    return [Residuals('gain, off from 1', '%', 100 * (response.gain.ravel() - 1), np.stack([x, y], axis=1), ('x (mm)', 'y (mm)'), ())]


def report(loads: Loads, response: Response, residuals: dict, output: Path, most: float) -> str:
    """The report of the fit; most: Pa, largest load."""
    pressed, loop = loads.forces > 0, response.loop
    lines = [f'{len(np.unique(loads.levels[pressed]))} loads, {loads.forces[pressed].min():.3g} to {loads.forces.max():.3g} N',
             'gain of each taxel: ' + ('from loads that cover all of them' if response.gain is not None else 'unknown, no load covered all '
                                       'of them evenly; taken as equal'),
             'untouched values: ' + ('known' if loads.zero is not None else 'not recorded; taken from the first frames at start'),
             'loop between rising and falling loads: ' + (f'up to {loop.width(most):.0f} Pa wide, forgotten within '
                                                          f'{loop.relaxation:.2g} s' if loop.share else 'none seen'),
             'shown late: ' + (', '.join(f'{part:.1%} of a load after {time:.2g} s' for part, time in zip(loop.late, loop.late_s)) or
                               'nothing'),
             f'normal force of held-out loads: error {residuals["held_out_force_mean"]:.1%} mean, '
             f'{residuals["held_out_force_largest"]:.1%} largest']
    return '\n'.join([*lines, *[f'left out: {line}' for line in loads.left_out[:10]], f'written: {output}'])

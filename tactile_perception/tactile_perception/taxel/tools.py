# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a taxel array by recordings of known normal loads (ground_truth/wrench)."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_driver.nodes.messages.images import grey_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from .._core.taxel import filled
from ..bags.stamped import TRUE_WRENCH, find_prefix
from ..common.progress import progress
from ..common.residuals import Residuals, write_and_report
from ..core.calibration_file import Specimen
from ..core.errors import BadCalibration, BadFrame
from ..core.messages import stamp_seconds
from ..core.parameter_files import read_parameters
from .calibration import Loads, calibrated_response, find_loop, fit_gains, held_out_errors, loaded_areas
from .constants import TAXEL
from .parameters import TAXEL_PARAMETERS, taxel_array
from .pressure import TaxelArray
from .response import Response, taxel_file

_MIN_FORCE = 1e-3  # N; smaller forces count as untouched


def read_loads(bags: list[Path], array: TaxelArray, dead: np.ndarray, namespace: str) -> Loads:
    """Read the loads in bags. Raises TactileError for bags without images or wrenches."""
    stretches, untouched, left_out, level = [], [], [], -1
    for number, bag in enumerate(bags):
        last = loaded = None
        for stamp, values, force in _frames(bag, array, namespace, left_out):
            if not np.isfinite(force):
                last = None
            elif force < _MIN_FORCE and loaded is None:
                untouched.append(values)
            # s after a load during which the recovery is also fitted; later it no longer changes
            elif force >= _MIN_FORCE or stamp - loaded < 30.0:  # after a load the sensor may still show a part of it
                force, loaded = (force, stamp) if force >= _MIN_FORCE else (0.0, loaded)
                if last is None or abs(force - last) > TAXEL.max_load_change * last:
                    last, level, begin = force, level + 1, None
                if begin is None or stamp - begin > 0.1:  # longer equal loads are split, because the shown pressure creeps
                    begin = stamp
                    stretches.append(([], [], last, f'{bag.name} at {stamp:.3f} s', number, level))
                stretches[-1][0].append(values)
                stretches[-1][1].append(stamp)
    if not any(one[2] for one in stretches):
        raise BadCalibration('no frame with a normal load in the recordings; ground_truth/wrench must contain it (force.z < 0)')
    zero = np.mean(untouched, axis=0, dtype=float) if untouched else None
    if zero is None:  # the recovery after a load is unknown
        stretches = [one for one in stretches if one[2]]
    values, stamps, forces, when, numbers, levels = zip(*stretches)
    pictures = np.array([np.mean(one, axis=0, dtype=float) for one in values]) - (0 if zero is None else zero)
    pictures = np.array([filled(picture, dead | np.isnan(picture)) for picture in pictures.astype(np.float32)])
    return Loads(pictures, np.array(forces), zero, left_out, list(when), np.array([np.mean(one) for one in stamps]), np.array(numbers),
                 np.array(levels))


def _frames(bag: Path, array: TaxelArray, namespace: str, left_out: list[str]):
    """Yield (stamp s, values, normal force N) of each frame; NaN for an unknown force."""
    waiting = None
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace)
        if prefix + TRUE_WRENCH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUE_WRENCH}: calibration needs the normal force')
        for raw in progress(reader.messages({prefix + 'image_raw', prefix + TRUE_WRENCH}), f'messages of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            stamp = stamp_seconds(message.header)
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


def calibrate_taxels(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit the response to known normal loads, write the calibration file and the plot of its residuals, and return a report.

    The bags hold images and ground_truth/wrench. See `SensorType.calibrate`.
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
    largest = float(np.max(loads.forces / loaded_areas(loads, array.taxel_area)))
    by_force, *others = held_out_residuals(loads, array, errors)
    return write_and_report(output, taxel_file(response, residuals, span, loads.left_out, Specimen(serial, values)), [by_force],
                            report(loads, response, residuals, largest), [*others, *_gains(response, array)])


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
        found.append(Residuals('force at its position', '%', percent, middle, ('x (mm)', 'y (mm)'), when))
    return found


def _gains(response: Response, array: TaxelArray) -> list[Residuals]:
    """Deviation of each taxel's gain from 1, for the plot."""
    if response.gain is None:
        return []
    x, y = (1e3 * grid.ravel() for grid in np.meshgrid(array.x, array.y))
    return [Residuals('gain, deviation from 1', '%', 100 * (response.gain.ravel() - 1), np.stack([x, y], axis=1), ('x (mm)', 'y (mm)'), ())]


def report(loads: Loads, response: Response, residuals: dict, largest: float) -> list[str]:
    """Lines that describe the fit; largest: Pa, largest load."""
    pressed, loop = loads.forces > 0, response.loop
    return [f'{len(np.unique(loads.levels[pressed]))} loads, {loads.forces[pressed].min():.3g} to {loads.forces.max():.3g} N',
             'gain of each taxel: ' + ('from loads that cover all of them' if response.gain is not None else 'unknown, no load covered all '
                                       'of them evenly; taken as equal'),
             'untouched values: ' + ('known' if loads.zero is not None else 'not recorded; taken from the first frames at start'),
             'loop between rising and falling loads: ' + (f'up to {loop.width(largest):.0f} Pa wide, relaxes within '
                                                          f'{loop.relaxation:.2g} s' if loop.share else 'none seen'),
             'shown late: ' + (', '.join(f'{part:.1%} of a load after {time:.2g} s' for part, time in zip(loop.late, loop.late_s)) or
                               'nothing'),
             f'normal force of held-out loads: error {residuals["held_out_force_mean"]:.1%} mean, '
             f'{residuals["held_out_force_largest"]:.1%} largest']

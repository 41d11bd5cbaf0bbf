# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a taxel array: fits pressure against value to recordings of known normal loads (ground_truth/wrench)."""
from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...bags.rosbag import BagReader
from ...bags.stamped import TRUE_WRENCH, find_prefix
from ...calibration.files.format import Specimen
from ...calibration.files.taxel import write_taxels
from ...calibration.residuals import Residuals, outliers, report_residuals
from ...common.progress import Progress
from ...errors import BadCalibration, BadFrame
from ...nodes.messages import conversions as convert
from ...nodes.messages.serialization import MessageCodec
from ...nodes.stages.taxel import taxel_values
from ...parameters.file import read_parameters
from ...parameters.taxel import TAXEL_PARAMETERS, taxel_array
from ...taxel.array import TaxelArray
from ...taxel.repair import dead_mask, fill
from ...taxel.response import Response, fit_gains, fit_response

_SAME = 0.02  # chosen: relative difference below which loads count as equal
_PARTS = 3  # chosen: folds of the cross-validation
_ZERO = 1e-3  # N, chosen: smaller forces count as untouched


@dataclass
class Loads:
    """Mean frame under each load.

    changes: (N, rows, columns), less the untouched frame; forces: (N,) N; zero: untouched frame (rows, columns) or None; left_out: one line
    per unusable frame; when: recording and time of each load.
    """

    changes: np.ndarray
    forces: np.ndarray
    zero: np.ndarray | None
    left_out: list[str]
    when: list[str]


def read_loads(bags: list[Path], array: TaxelArray, dead: np.ndarray, namespace: str) -> Loads:
    """The loads in bags. Raises TactileError for bags without images or wrenches."""
    stretches, untouched, left_out = [], [], []
    for bag in bags:
        last = None
        for stamp, values, force in _frames(bag, array, namespace, left_out):
            if not np.isfinite(force):
                last = None
            elif force < _ZERO:
                untouched.append(values)
                last = None
            elif last is not None and abs(force - last) < _SAME * last:
                stretches[-1][0].append(values)
            else:
                stretches.append(([values], force, f'{bag.name} at {stamp:.3f} s'))
                last = force
    if not stretches:
        raise BadCalibration('no frame with a normal load in the recordings; ground_truth/wrench must contain it (force.z < 0)')
    zero = np.mean(untouched, axis=0, dtype=float) if untouched else None
    pictures = np.array([np.mean(values, axis=0, dtype=float) for values, _, _ in stretches]) - (0 if zero is None else zero)
    pictures = np.array([fill(picture.astype(np.float32), dead) for picture in pictures])
    return Loads(pictures, np.array([force for _, force, _ in stretches]), zero, left_out, [when for _, _, when in stretches])


def _frames(bag: Path, array: TaxelArray, namespace: str, left_out: list[str]):
    """Yield (stamp s, values, normal force N) of each frame; NaN for an unknown force."""
    codec, waiting = MessageCodec(), None
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace)
        if prefix + TRUE_WRENCH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUE_WRENCH}: calibration needs the normal force')
        for raw in Progress(reader.messages({prefix + 'image_raw', prefix + TRUE_WRENCH}), f'messages of {bag.name}'):
            message = codec.decode(raw.data, raw.type_name)
            stamp = convert.stamp_seconds(message.header)
            if raw.topic == prefix + 'image_raw':
                if waiting is not None:
                    yield *waiting, np.nan
                try:
                    waiting = stamp, array.frame(taxel_values(message))
                except BadFrame as error:
                    left_out.append(f'{bag.name} at {stamp:.3f} s: {error}')
                    waiting = None
            elif waiting is not None and waiting[0] == stamp:
                yield *waiting, -float(message.wrench.force.z)
                waiting = None


def held_out_errors(loads: Loads, array: TaxelArray, gain: np.ndarray | None) -> np.ndarray:
    """Cross-validation errors (N,) of the forces, relative; NaN where the other folds do not determine the response."""
    errors = np.full(len(loads.forces), np.nan)
    for part in range(_PARTS):
        out = np.arange(len(errors)) % _PARTS == part
        try:
            response, _ = fit_response(loads.changes[~out], loads.forces[~out], array.taxel_area, gain)
        except BadCalibration:
            continue
        predicted = np.array([response.pressure(np.maximum(change, 0)).sum() * array.taxel_area for change in loads.changes[out]])
        errors[out] = predicted / loads.forces[out] - 1
    return errors


def calibrate_taxels(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit, write output and the plot of the residuals beside it, and return a report; serial: of the device.

    Raises TactileError for recordings that cannot determine the response.
    """
    values = read_parameters(params, 'taxel_contact_node', TAXEL_PARAMETERS)
    array = taxel_array(values)
    loads = read_loads(bags, array, dead_mask(array.shape, [n for n in values['dead_taxels'] if n >= 0]), namespace)
    gain = fit_gains(loads.changes)
    response, _ = fit_response(loads.changes, loads.forces, array.taxel_area, gain)
    errors = held_out_errors(loads, array, gain)
    residuals = {'held_out_force_mean': float(np.nanmean(np.abs(errors))) if np.isfinite(errors).any() else float('nan'),
                 'held_out_force_largest': float(np.nanmax(np.abs(errors))) if np.isfinite(errors).any() else float('nan')}
    span = {'force': [float(loads.forces.min()), float(loads.forces.max())]}
    known = replace(response, zero=loads.zero)
    held_out = held_out_residuals(loads, array, errors)
    standing_out = outliers(held_out[:1])
    write_taxels(output, known, residuals, span, loads.left_out, Specimen(serial, values), standing_out)
    shown = [*held_out, *_gains(response, array)]
    return '\n'.join([report(loads, response, residuals, output), *report_residuals(shown, standing_out, output, 'taxel array')])


def held_out_residuals(loads: Loads, array: TaxelArray, errors: np.ndarray) -> list[Residuals]:
    """Cross-validation error of each load's force over the force, and over the pad if the loads are at several positions.

    errors: (N,) relative.
    """
    percent = 100 * errors
    found = [Residuals('force', '%', percent, np.stack([loads.forces, percent], axis=1), ('force (N)', 'error (% of it)'), loads.when)]
    weight = np.maximum(loads.changes, 0).reshape(len(loads.forces), -1)
    x, y = (1e3 * grid.ravel() for grid in np.meshgrid(array.x, array.y))
    middle = np.stack([weight @ x, weight @ y], axis=1) / np.maximum(weight.sum(axis=1), 1e-12)[:, None]
    if np.ptp(middle, axis=0).max() > 1e3 * array.pitch:
        found.append(Residuals('force at its place', '%', percent, middle, ('x (mm)', 'y (mm)'), loads.when))
    return found


def _gains(response: Response, array: TaxelArray) -> list[Residuals]:
    """Deviation of each taxel's gain from 1, for the plot."""
    if response.gain is None:
        return []
    x, y = (1e3 * grid.ravel() for grid in np.meshgrid(array.x, array.y))
    return [Residuals('gain, off from 1', '%', 100 * (response.gain.ravel() - 1), np.stack([x, y], axis=1), ('x (mm)', 'y (mm)'), ())]


def report(loads: Loads, response: Response, residuals: dict, output: Path) -> str:
    """The report of the fit."""
    lines = [f'{len(loads.forces)} loads, {loads.forces.min():.3g} to {loads.forces.max():.3g} N',
             'gain of each taxel: ' + ('from loads that cover all of them' if response.gain is not None else 'unknown, no load covered all '
                                       'of them evenly; taken as equal'),
             'untouched values: ' + ('known' if loads.zero is not None else 'not recorded; taken from the first frames at start'),
             f'normal force of held-out loads: error {residuals["held_out_force_mean"]:.1%} mean, '
             f'{residuals["held_out_force_largest"]:.1%} largest']
    return '\n'.join([*lines, *[f'left out: {line}' for line in loads.left_out[:10]], f'written: {output}'])

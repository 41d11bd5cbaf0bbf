# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a PSD finger: fits its model to recordings of presses at known positions (ground_truth/contacts)."""
from __future__ import annotations

from pathlib import Path

import numpy as np
from tactile_driver.recordings.compressed import ImageBagReader as BagReader
from tactile_driver.recordings.serialization import decode

from ...bags.stamped import TRUTH, VOLTAGES, find_prefix
from ...calibration.files.format import Specimen
from ...calibration.files.psd import write_psd
from ...calibration.residuals import Residuals, outliers, report_residuals
from ...common.progress import Progress
from ...errors import BadCalibration
from ...nodes.messages import conversions as convert
from ...parameters.file import read_parameters
from ...parameters.psd import PSD_PARAMETERS
from ...psd.geometry import log_map
from ...psd.model_fit import FingerFit, fit_finger
from ...psd.presses import Recording, find_presses

_LONGEST_S = 0.25  # chosen: the latest ground truth holds at most this long
_EARLY_S = 1e-6  # chosen: tolerance of the comparison of stamps


def read_recording(bag: Path, namespace: str) -> Recording:
    """Samples of one bag, each with the latest ground truth. Raises TactileError for a bag without voltages or truth."""
    blocks, truths = [], []
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace, 'voltages', VOLTAGES)
        if prefix + TRUTH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUTH}: calibration needs the positions of the presses')
        for raw in Progress(reader.messages({prefix + 'voltages', prefix + TRUTH}), f'messages of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            (blocks if raw.topic == prefix + 'voltages' else truths).append((convert.stamp_seconds(message.header), message))
    volts, times, period = _samples(blocks, bag)
    if not truths:
        raise BadCalibration(f'{bag}: nothing on {prefix}{TRUTH}: calibration needs the positions of the presses')
    return _with_truth(volts, times, period, sorted(truths, key=lambda pair: pair[0]), bag.name)


def _samples(blocks: list, bag: Path) -> tuple[np.ndarray, np.ndarray, float]:
    """Voltages (N, 4), their times (N,), s, and the median sample period, s."""
    usable = [(stamp, m) for stamp, m in blocks if len(m.voltages) and len(m.voltages) % 4 == 0]
    periods = np.array([m.sample_period for _, m in usable])
    if not len(usable) or not (periods > 0).any():
        raise BadCalibration(f'{bag}: no voltages with a sample_period above 0')
    period = float(np.median(periods[periods > 0]))
    volts = [np.frombuffer(m.voltages, np.float32).reshape(-1, 4) for _, m in usable]
    times = [stamp + period * np.arange(len(v)) for (stamp, _), v in zip(usable, volts)]
    order = np.argsort(np.concatenate(times), kind='stable')
    return np.concatenate(volts).astype(float)[order], np.concatenate(times)[order], period


def _with_truth(volts: np.ndarray, times: np.ndarray, period: float, truths: list, name: str) -> Recording:
    """The samples with known contact state; samples with several contacts have no position."""
    rows = np.array([_told(message.contacts) for _, message in truths])
    stamps = np.array([stamp for stamp, _ in truths])
    last = np.searchsorted(stamps, times + _EARLY_S, side='right') - 1
    known = (last >= 0) & (times - stamps[np.maximum(last, 0)] <= _LONGEST_S)
    told = rows[last[known]]
    return Recording(volts[known], period, told[:, 0] > 0, told[:, 1:4], told[:, 4], told[:, 5], times[known], name)


def _told(contacts: list) -> tuple[float, ...]:
    """Number of contacts, and normal, force and depth of a single one; NaN for none or several."""
    if len(contacts) != 1:
        return len(contacts), *[np.nan] * 5
    places = (np.array([part.x, part.y, part.z]) for part in (contacts[0].position, contacts[0].normal))
    known = next((place / np.linalg.norm(place) for place in places if np.linalg.norm(place) > 0), np.full(3, np.nan))
    return 1, *known, contacts[0].force, contacts[0].depth


def calibrate_psd(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit, write output and the plot of the residuals beside it, and return a report; serial: of the device.

    Raises TactileError for recordings that cannot determine the model.
    """
    values = read_parameters(params, 'psd_contact_node', PSD_PARAMETERS)
    presses = find_presses([read_recording(bag, namespace) for bag in bags], values['saturation'])
    fit = fit_finger(presses)
    residuals = held_out_residuals(fit)
    standing_out = outliers(residuals)
    write_psd(output, fit, presses.left_out, Specimen(serial, values), standing_out)
    return '\n'.join([report(fit, presses.left_out, output), *report_residuals(residuals, standing_out, output, 'PSD finger')])


def held_out_residuals(fit: FingerFit) -> list[Residuals]:
    """Cross-validation errors of the map over the tilt of the normal."""
    tilt = np.degrees(log_map(fit.normal))
    return [Residuals('normal', 'degrees', np.degrees(fit.errors), tilt, ('tilt along x (degrees)', 'tilt along y (degrees)'), fit.when)]


def report(fit: FingerFit, left_out: list[str], output: Path) -> str:
    """The report of the fit."""
    def angle(errors: np.ndarray) -> str:
        return f'{np.degrees(errors.mean()):.2f} degrees mean, {np.degrees(errors.max()):.2f} degrees largest'
    low, high = np.degrees(fit.span['theta'])
    lines = [f'{fit.places} places, {low:.0f} to {high:.0f} degrees from the pole']
    if fit.model.smooth is not None:
        lines.append(f'cross-validation error of the map: {angle(fit.errors)}')
    lines.append(f"error of the paper's offset and factor at the places that they were fitted to: {angle(fit.paper_errors)}")
    for name in ('force', 'depth'):
        if getattr(fit.model, name) is not None:
            lines.append(f'{name}, cross-validation error over held-out segments: {fit.residuals[name + "_relative"]:.1%} median')
    creep = fit.model.creep
    if creep is not None:
        lines.append(f'creep of the cover: {creep.share:.1%} of a place comes late, within {creep.seconds * 1e3:.0f} ms')
    lines += [f'note: {line}' for line in fit.notes] + [f'left out: {line}' for line in left_out]
    return '\n'.join([*lines, f'written: {output}'])

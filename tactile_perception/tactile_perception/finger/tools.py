# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the tools do for a PSD finger: calibrate fits its model to bags of presses at known positions (ground_truth/contacts), and
convert_recording reads a folder with meta.json, input.npz (t, volts; label_phi, label_theta of a stage) and truth.npz.
"""
from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from tactile_driver.frame import SampleBlock
from tactile_driver.nodes.messages.conversions import header_of, instants, static_transform, voltages_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.truth import Touch
from tactile_driver.sources.source import FIRST_S

from ..bags.stamped import TRUTH, VOLTAGES, find_prefix
from ..common.progress import progress
from ..common.residuals import Residuals, write_and_report
from ..core.calibration_file import Specimen
from ..core.errors import BadCalibration, BadRecording
from ..core.messages import stamp_seconds
from ..core.parameter_files import read_parameters
from .calibration import FingerFit, Recording, find_presses, fit_finger, runs_of
from .map import direction, log_map
from .model import psd_file
from .parameters import PSD_PARAMETERS


def read_recording(bag: Path, namespace: str) -> Recording:
    """Samples of one bag, each with the latest ground truth. Raises TactileError for a bag without voltages or truth."""
    blocks, truths = [], []
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace, 'voltages', VOLTAGES)
        if prefix + TRUTH not in reader.topics:
            raise BadCalibration(f'{bag}: there is no topic {prefix}{TRUTH}; record the positions of the presses on it')
        for raw in progress(reader.messages({prefix + 'voltages', prefix + TRUTH}), f'messages of {bag.name}'):
            message = decode(raw.data, raw.type_name)
            (blocks if raw.topic == prefix + 'voltages' else truths).append((stamp_seconds(message.header), message))
    volts, times, period = _samples(blocks, bag)
    if not truths:
        raise BadCalibration(f'{bag}: the topic {prefix}{TRUTH} is empty; record the positions of the presses on it')
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
    rows = np.array([_reported(message.contacts) for _, message in truths])
    stamps = np.array([stamp for stamp, _ in truths])
    last = np.searchsorted(stamps, times + 1e-6, side='right') - 1
    known = (last >= 0) & (times - stamps[np.maximum(last, 0)] <= 0.25)  # age up to which the latest ground truth is valid
    latest = rows[last[known]]
    return Recording(volts[known], period, latest[:, 0] > 0, latest[:, 1:4], latest[:, 4], latest[:, 5], times[known], name)


def _reported(contacts: list) -> tuple[float, ...]:
    """Number of contacts, and normal, force and depth of a single one; NaN for none or several."""
    if len(contacts) != 1:
        return len(contacts), *[np.nan] * 5
    vectors = (np.array([part.x, part.y, part.z]) for part in (contacts[0].position, contacts[0].normal))
    normal = next((vector / np.linalg.norm(vector) for vector in vectors if np.linalg.norm(vector) > 0), np.full(3, np.nan))
    return 1, *normal, contacts[0].force, contacts[0].depth


def read_radius(params: Path) -> float:
    """Outer radius in m of the hemisphere that a parameter file describes. Raises BadArgument for a wrong value."""
    return read_parameters(params, 'psd_contact_node', PSD_PARAMETERS)['radius']


def calibrate_psd(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit the model, write the calibration file and the plot of its residuals, and return a report. See `SensorType.calibrate`."""
    values = read_parameters(params, 'psd_contact_node', PSD_PARAMETERS)
    presses = find_presses([read_recording(bag, namespace) for bag in bags], values['saturation'])
    fit = fit_finger(presses)
    residuals = Residuals('normal', 'degrees', np.degrees(fit.errors), np.degrees(log_map(fit.normal)),
                          ('tilt along x (degrees)', 'tilt along y (degrees)'), fit.when)
    return write_and_report(output, psd_file(fit, presses.left_out, Specimen(serial, values)), [residuals], report(fit))


def report(fit: FingerFit) -> list[str]:
    """Lines about the fit."""
    def angle(errors: np.ndarray) -> str:
        return f'{np.degrees(errors.mean()):.2f} degrees mean, {np.degrees(errors.max()):.2f} degrees largest'
    low, high = np.degrees(fit.span['theta'])
    lines = [f'{fit.positions} positions, {low:.0f} to {high:.0f} degrees from the pole']
    if fit.model.smooth is not None:
        lines.append(f'cross-validation error of the map: {angle(fit.errors)}')
    lines.append(f"error of the paper's offset and factor at the positions that they were fitted to: {angle(fit.paper_errors)}")
    for name in ('force', 'depth'):
        if getattr(fit.model, name) is not None:
            lines.append(f'{name}, cross-validation error over held-out segments: {fit.residuals[name + "_relative"]:.1%} median')
    creep = fit.model.creep
    if creep is not None:
        lines.append(f'creep of the cover: {creep.share:.1%} of a displacement comes late, within {creep.seconds * 1e3:.0f} ms')
    return lines


class PsdRecording:
    """A recording folder. Raises BadRecording for a missing or damaged file.

    path: the folder. The ground truth position of a press is the label of the stage where there is one, otherwise the true position.
    """

    CONTACT = 2  # value of phase in truth.npz

    def __init__(self, folder: str | Path):
        self.path = Path(folder)
        try:
            self.meta = json.loads((self.path / 'meta.json').read_text())
            self._input, self._truth = (dict(np.load(self.path / name)) for name in ('input.npz', 'truth.npz'))
            self.volts, self._t = self._input['volts'].astype(np.float32), self._input['t']
        except (OSError, ValueError, KeyError, BadZipFile) as error:
            raise BadRecording(f'recording {self.path}: {error!r}') from error
        self.period = float(np.median(np.diff(self._t)))

    def __len__(self) -> int:
        return len(self.volts)

    def messages(self, frame_id: str) -> Iterator[tuple[int, str, object]]:
        """Yield (stamp in ns, topic, message) in order: blocks of voltages, each followed by the ground truth at its first sample and at
        samples where contacts begin or end.
        """
        numbers, count = TouchNumbers(), max(round(0.005 / self.period), 1)  # duration of one message, the default of psd_node
        normals, touching = self._normals(), self._truth['n_contacts'] * (self._truth['phase'] == self.CONTACT)
        for begin in range(0, len(self), count):
            block = SampleBlock(self.volts[begin:begin + count], self._stamp(begin), self.period)
            yield block.stamp_ns, 'voltages', voltages_message(block, frame_id)
            for k in (begin + np.array(instants(touching[begin:begin + count]))).tolist():
                touches = self._touches(k, normals[k])
                yield self._stamp(k), 'ground_truth/contacts', contacts_message(touches, numbers.assign(touches),
                                                                                 header_of(self._stamp(k), frame_id))

    def _stamp(self, k: int) -> int:
        return round((float(self._t[k]) + FIRST_S) * 1e9)

    def _touches(self, k: int, normal: np.ndarray) -> list[Touch]:
        if self._truth['phase'][k] != self.CONTACT:
            return []
        radius, depth = float(self.meta['R_s_m']), 1e-3 * float(self._truth['indentation_mm'][k])
        touch = Touch(radius * normal, normal, depth, float(self._truth['force_N'][k]))
        return [touch] * int(self._truth['n_contacts'][k])

    def _normals(self) -> np.ndarray:
        """Unit normals (N, 3); those of the label during each labelled press."""
        normals = np.array(self._truth['normal'], float)
        labels = self._input.get('label_theta')
        if labels is None:
            return normals
        for begin, end in runs_of(self._truth['phase'] == self.CONTACT):
            known = np.flatnonzero(np.isfinite(labels[begin:end]))
            if len(known):
                phi, theta = (float(self._input[name][begin + known[0]]) for name in ('label_phi', 'label_theta'))
                normals[begin:end] = direction(phi, theta)
        return normals

    def parameters(self) -> dict[str, object]:
        """Name -> value of the parameters that meta.json contains."""
        return {'sensor_type': self.meta['sensor'], 'radius': float(self.meta['R_s_m'])}

    def transforms(self, frame_id: str) -> list:
        """TransformStamped of the tip in the sensor frame."""
        return [static_transform(frame_id, f'{frame_id}_tip', (0.0, 0.0, float(self.meta['R_s_m'])))]

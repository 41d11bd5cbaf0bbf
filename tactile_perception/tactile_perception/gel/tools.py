# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a gel by known weights, and of a dome of pins by presses at known positions."""
from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

from ..bags.stamped import TRUE_WRENCH, TRUTH, find_prefix, pairs_of
from ..common.progress import progress
from ..common.residuals import Residuals, write_and_report
from ..core.calibration_file import CalibrationFile, Specimen, write_calibration
from ..core.errors import BadCalibration, BadFrame
from ..core.messages import stamp_seconds
from ..core.parameter_files import read_parameters
from ..dots.tracker import make_tracker
from ..layer.undeformed import spacing_of
from .parameters import GEL_NODE, GEL_PARAMETERS, PINS_NODE, PINS_PARAMETERS
from .pins import SENSOR as PINS, fit_pins, smoothed
from .stage import GEL, GelStage

_MIN_FRAMES = 5  # with the same load, for a median that one bad frame does not change


class _Load(NamedTuple):
    """A known load and what the estimator makes of it. newtons: the load; unit_force: N, the estimated force for a Young's modulus of 1 Pa;
    sigma: relative standard deviation of the latter."""

    newtons: float
    unit_force: float
    sigma: float


def calibrate_weights(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '',
                      weight: float | None = None) -> str:
    """Fit the Young's modulus of a gel to known weights, and write the calibration file.

    Parameters
    ----------
    bags : list of Path
        Recordings. Each begins with the untouched gel.
    params, output, namespace, serial
        See `SensorType.calibrate`.
    weight : float, optional
        Force in N that presses in each recording; None: the recordings contain `ground_truth/wrench`.

    Returns
    -------
    str
        Report.

    Raises
    ------
    BadCalibration
        If a recording contains no press with a known load, or the weight is not above 0.

    Notes
    -----
    Force is proportional to Young's modulus. Each load therefore gives an estimate of the modulus: the load over the force that is
    estimated for a modulus of 1 Pa. The result is their geometric mean. The relative standard deviation of a force is the scatter of
    these estimates, or the median of what the estimator states, whichever is larger.
    """
    if weight is not None and not 0 < weight < np.inf:
        raise BadCalibration(f'--weight {weight:g}: the force of the weight in N must be above 0; 1 kg is 9.81 N')
    left_out = []
    loads = [load for bag in bags for load in _read_loads(bag, params, namespace, weight, left_out)]
    logs = np.log([load.newtons / load.unit_force for load in loads])
    scatter = float(np.std(logs, ddof=1)) if len(logs) > 1 else 0.0
    modulus, sigma = float(np.exp(logs.mean())), max(scatter, float(np.median([load.sigma for load in loads])))
    newtons = [load.newtons for load in loads]
    write_calibration(output, CalibrationFile(
        GEL, {'young_modulus': 'Pa', 'force_sigma': 'of the force'}, {'young_modulus': modulus, 'force_sigma': sigma},
        {'scatter': scatter, 'loads': len(loads)}, {'force': [min(newtons), max(newtons)]}, left_out, serial=serial,
        parameters=Specimen(serial, read_parameters(params, GEL_NODE, GEL_PARAMETERS)).parameters(GEL)))
    return '\n'.join([
        f'{len(loads)} loads',
        *(f'{load.newtons:.3g} N: {modulus * load.unit_force:.3g} N with this calibration' for load in loads),
        f"Young's modulus {modulus:.4g} Pa; the standard deviation of a force is {sigma:.1%} of it",
        *(f'left out: {line}' for line in left_out), f'written: {output}'])


def _read_loads(bag: Path, params: Path, namespace: str, weight: float | None, left_out: list[str]) -> list[_Load]:
    """The loads of a recording: frames with the same load, to two digits, are one."""
    groups = defaultdict(list)
    frames = list(_pressed_frames(bag, params, namespace, left_out, weight is None))
    if weight is not None:  # the weight is at rest in the later half
        frames = [frame._replace(newtons=weight) for frame in frames[len(frames) // 2:]]
    for frame in frames:
        if frame.newtons > 0:
            groups[f'{frame.newtons:.1e}'].append(frame)
    loads = [_Load(*np.median(group, axis=0)) for group in groups.values() if len(group) >= _MIN_FRAMES]
    if not loads:
        raise BadCalibration(f'{bag}: fewer than {_MIN_FRAMES} images show a press with a known force; record the untouched gel for a '
                             'second, then a ball on the gel with the weight on the ball'
                             + (f'; last problem: {left_out[-1]}' if left_out else ''))
    return loads


def _pressed_frames(bag: Path, params: Path, namespace: str, left_out: list[str], is_measured: bool) -> Iterator[_Load]:
    """The frames of a recording that show a press; newtons: NaN where ground_truth/wrench has no message of the image's stamp. is_measured:
    whether ground_truth/wrench is required."""
    stage = GelStage(read_parameters(params, GEL_NODE, GEL_PARAMETERS) | {'gel.young_modulus': 1.0, 'calibration': ''})
    newtons, estimates = {}, {}
    with BagReader(bag) as reader:
        prefix = find_prefix(reader.topics, namespace)
        if is_measured and prefix + TRUE_WRENCH not in reader.topics:
            raise BadCalibration(f'{bag}: no {prefix}{TRUE_WRENCH}; give the force of the weight in N by --weight')
        wanted = {prefix + name for name in ('image_raw', 'camera_info', TRUE_WRENCH)}
        for raw in progress(reader.messages(wanted), f'messages of {bag.name}'):
            topic, message = raw.topic.removeprefix(prefix), decode(raw.data, raw.type_name)
            stamp = stamp_ns_of(message.header)
            try:
                if topic == 'camera_info':
                    stage.take(topic, message)
                elif topic == TRUE_WRENCH:
                    newtons[stamp] = -message.wrench.force.z
                else:
                    force = -stage.process(message, ['wrench'])['wrench'][0].wrench.force.z
                    estimates[stamp] = force, float(stage.estimator.contact.force_sigma[2])
            except BadFrame as error:
                left_out.append(f'{bag.name} at {1e-9 * stamp:.2f} s: {error}')
    for stamp, (force, sigma) in estimates.items():
        if force > 0:
            yield _Load(newtons.get(stamp, np.nan), force, sigma / force)


def calibrate_pins(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit the position and depth of presses on pins to recordings of a tip at known positions, and write the calibration file.

    Parameters
    ----------
    bags : list of Path
        Recordings with `ground_truth/contacts`. Each begins with untouched pins.
    params, output, namespace, serial
        See `SensorType.calibrate`.

    Returns
    -------
    str
        Report.

    Raises
    ------
    TactileError
        If the recordings cannot determine the model.
    """
    values = read_parameters(params, PINS_NODE, PINS_PARAMETERS)
    undeformed, presses, names, left_out = None, [], [], []
    for bag in bags:
        tracker = make_tracker(values, image_only=True)
        for name, found in pairs_of(bag, namespace, ('image_raw', TRUTH), lambda message: None):
            contacts = found[TRUTH].contacts
            try:
                tracks = tracker.process(image_to_array(found['image_raw']), stamp_seconds(found['image_raw'].header))
            except BadFrame as error:
                left_out.append(f'{name}: {error}')
                continue
            undeformed = tracks.rest_uv if undeformed is None else undeformed
            if len(contacts) == 1 and contacts[0].depth > 0:
                tip = contacts[0].position
                presses.append((tracks, (tip.x, tip.y, tip.z), contacts[0].depth))
                names.append(name)
    if not presses:
        raise BadCalibration(f'no usable press in the recordings; left out: {"; ".join(left_out[:3]) or "nothing"}')
    spacing = spacing_of(undeformed)
    position, depth = np.array([press[1] for press in presses]), np.array([press[2] for press in presses])
    displacements = np.array([smoothed(undeformed, spacing, tracks) for tracks, *_ in presses])
    model, error = fit_pins(undeformed, displacements, position, depth)
    distance = np.linalg.norm(error[:, :2], axis=1)
    xy, axes = 1e3 * position[:, :2], ('x, mm', 'y, mm')
    residuals = [Residuals(name, 'mm', 1e3 * value, xy, axes, names) for name, value in (('position', distance), ('depth', error[:, 2]))]
    numbers = {'position_mean': distance.mean(), 'position_95': np.percentile(distance, 95), 'depth_rms': np.sqrt(np.mean(error[:, 2]**2))}
    span = {'depth': depth, 'x': position[:, 0], 'y': position[:, 1]}
    content = CalibrationFile(
        PINS, {'lengths': 'm', 'rest': 'px', 'residuals': 'm'}, asdict(model), {name: float(value) for name, value in numbers.items()},
        {name: [float(value.min()), float(value.max())] for name, value in span.items()}, left_out, serial=serial,
        parameters=Specimen(serial, values).parameters(PINS))
    return write_and_report(output, content, residuals, [
        f'{len(presses)} frames of presses',
        f'errors at positions that were left out of the fit: position {1e3 * distance.mean():.2f} mm mean, '
        f'{1e3 * np.percentile(distance, 95):.2f} mm at 95 %, depth {1e3 * numbers["depth_rms"]:.3f} mm RMS'])

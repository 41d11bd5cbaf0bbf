# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a gel by known weights, and of a dome of pins by presses at known positions."""
from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from tactile_driver.nodes.messages.images import image_to_array

from ..bags.stamped import TRUTH, pairs_of
from ..common.residuals import Residuals, write_and_report
from ..core.calibration_file import CalibrationFile, Specimen, write_calibration
from ..core.errors import BadCalibration, BadFrame
from ..core.messages import stamp_seconds
from ..core.parameter_files import read_parameters
from ..dots.tracker import make_tracker
from ..layer.tools import fit_modulus, load_report, read_loads
from ..layer.undeformed import spacing_of
from .parameters import GEL_NODE, GEL_PARAMETERS, PINS_NODE, PINS_PARAMETERS
from .pins import SENSOR as PINS, fit_pins, smoothed
from .stage import GEL, GelStage


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
    """
    left_out: list[str] = []
    values = read_parameters(params, GEL_NODE, GEL_PARAMETERS)
    loads = read_loads(bags, lambda: GelStage(values | {'gel.young_modulus': 1.0, 'calibration': ''}),
                       lambda force, stage: float(stage.estimator.contact.force_sigma[2]), namespace, weight, left_out)
    fit, newtons = fit_modulus(loads), [load.newtons for load in loads]
    write_calibration(output, CalibrationFile(
        GEL, {'young_modulus': 'Pa', 'force_sigma': 'of the force'}, {'young_modulus': fit.value, 'force_sigma': fit.force_sigma},
        {'scatter': fit.scatter, 'loads': len(loads)}, {'force': [min(newtons), max(newtons)]}, left_out, serial=serial,
        parameters=Specimen(serial, values).parameters(GEL)))
    return load_report(loads, fit, "Young's modulus", left_out, output)


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

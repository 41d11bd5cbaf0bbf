# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibrates a dome of pins: fits place and depth to recordings of a tip pressed at known places (ground_truth/contacts)."""
from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from tactile_driver.nodes.messages.images import image_to_array

from ..bags.stamped import TRUTH, pairs_of
from ..calibration.files.format import CalibrationFile, Specimen
from ..calibration.residuals import Residuals, write_and_report
from ..dots.tracker import make_tracker
from ..errors import BadCalibration, BadFrame
from ..nodes.messages import conversions as convert
from ..parameters.file import read_parameters
from .parameters import PINS_NODE, PINS_PARAMETERS
from .pins import SENSOR, fit_pins, smoothed
from .undeformed import spacing_of


def calibrate_pins(bags: list[Path], params: Path, output: Path, namespace: str = '', serial: str = '') -> str:
    """Fit, write output and the plot of the residuals beside it, and return a report; serial: of the device. Raises TactileError for
    recordings that cannot determine the model."""
    values = read_parameters(params, PINS_NODE, PINS_PARAMETERS)
    rest, rows, names, left_out = None, [], [], []
    for bag in bags:
        tracker = make_tracker(values, image_only=True)
        for name, found in pairs_of(bag, namespace, ('image_raw', TRUTH), lambda message: None):
            contacts = found[TRUTH].contacts
            try:
                tracks = tracker.process(image_to_array(found['image_raw']), convert.stamp_seconds(found['image_raw'].header))
            except BadFrame as error:
                left_out.append(f'{name}: {error}')
                continue
            rest = tracks.rest_uv if rest is None else rest
            if len(contacts) == 1 and contacts[0].depth > 0:
                at = contacts[0].position
                rows.append((tracks, (at.x, at.y, at.z), contacts[0].depth))
                names.append(name)
    if not rows:
        raise BadCalibration(f'no usable press in the recordings; left out: {"; ".join(left_out[:3]) or "nothing"}')
    spacing = spacing_of(rest)
    position, depth = np.array([row[1] for row in rows]), np.array([row[2] for row in rows])
    model, error = fit_pins(rest, np.array([smoothed(rest, spacing, tracks) for tracks, *_ in rows]), position, depth)
    off = np.linalg.norm(error[:, :2], axis=1)
    place, axes = 1e3 * position[:, :2], ('x, mm', 'y, mm')
    residuals = [Residuals(name, 'mm', 1e3 * value, place, axes, names) for name, value in (('position', off), ('depth', error[:, 2]))]
    numbers = {'position_mean': off.mean(), 'position_95': np.percentile(off, 95), 'depth_rms': np.sqrt(np.mean(error[:, 2]**2))}
    span = {'depth': depth, 'x': position[:, 0], 'y': position[:, 1]}
    content = CalibrationFile(
        SENSOR, {'lengths': 'm', 'rest': 'px', 'residuals': 'm'}, asdict(model), {name: float(value) for name, value in numbers.items()},
        {name: [float(value.min()), float(value.max())] for name, value in span.items()}, left_out, serial=serial,
        parameters=Specimen(serial, values).parameters(SENSOR))
    return write_and_report(output, content, residuals, [
        f'{len(rows)} frames of presses', f'errors at left-out places: position {1e3 * off.mean():.2f} mm mean, '
        f'{1e3 * np.percentile(off, 95):.2f} mm at 95 %, depth {1e3 * numbers["depth_rms"]:.3f} mm RMS'])

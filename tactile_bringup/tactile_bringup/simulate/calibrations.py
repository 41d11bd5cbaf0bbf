# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Generates calibration/*_sim.yaml: calibrates the simulated specimens as users calibrate theirs, by presses at known positions or loads.

    python3 -m tactile_bringup.simulate.calibrations FOLDER [TYPE ...]

A file for a sheet or dome holds the best touch method only, and the errors of all.
"""
from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.calibration_file import read_calibration, write_calibration
from tactile_perception.core.sensor_type import SENSOR_TYPES
from tactile_perception.press.calibration import METHODS, best_method
from tactile_perception.tools.calibrate import calibrator

from .. import share
from ..parameters.files import LICENCE
from .bags import writer_of

SPECIMENS = tuple(name for name, kind in SENSOR_TYPES.items() if kind.calibration_scene and kind.package == 'tactile_bringup')


def calibrate_specimen(sensor_type: str, output: Path) -> str:
    """Simulate the calibration scene of a sensor type of SPECIMENS, calibrate, and write the calibration to output; the report."""
    scene, rate, options = SENSOR_TYPES[sensor_type].calibration_scene
    write, *_ = writer_of(sensor_type)
    with TemporaryDirectory() as folder:
        bag = Path(folder) / sensor_type
        write(bag, scene, rate)
        reported = calibrator(sensor_type, **options)([bag], Path(share('params', f'{sensor_type}_sim.yaml')), output)
    if sensor_type in MARKER_SENSORS:
        file = read_calibration(output, sensor_type)
        best = best_method(file.residuals, file.fitted[METHODS])
        file.fitted[METHODS] = {best: file.fitted[METHODS][best]}
        write_calibration(output, file)
    output.write_text(LICENCE + output.read_text())  # for a file that ships
    return reported


if __name__ == '__main__':
    for name in sys.argv[2:] or SPECIMENS:
        print(calibrate_specimen(name, Path(sys.argv[1], f'{name}_sim.yaml')), flush=True)

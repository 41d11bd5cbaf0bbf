# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Generates calibration/*_sim.yaml: calibrates the simulated specimens as users calibrate theirs, by presses at known positions or loads.

    python3 -m tactile_bringup.simulate.calibrations FOLDER [TYPE ...]

A file for a sheet or dome holds the best touch method only, and the errors of all.
"""
from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.calibration_file import read_calibration, write_calibration
from tactile_perception.finger.tools import calibrate_psd
from tactile_perception.force_taxels.tools import calibrate_weights
from tactile_perception.gel.tools import calibrate_pins
from tactile_perception.photometric.tools import calibrate_balls
from tactile_perception.press.calibration import METHODS, best_method
from tactile_perception.press.tools import calibrate_markers
from tactile_perception.taxel.tools import calibrate_taxels

from .. import share
from ..parameters.files import LICENCE
from .bags import write_psd_scene, write_scene, write_taxel_scene, write_vector_scene

# Sensor type -> calibration, scene writer, scene, rate in Hz (3 Hz gives sheets and dome two to four frames per depth).
SPECIMENS = {**{name: (calibrate_markers, write_scene, f'{name}_calibration', 3.0) for name in MARKER_SENSORS},
             'pins': (calibrate_pins, write_scene, 'pins_calib', 4.0),
             'photometric_gel': (partial(calibrate_balls, sphere_radius=0.0025), write_scene, 'photometric_calib', 8.0),
             'psd_finger': (calibrate_psd, write_psd_scene, 'calibration', 1000.0),
             'taxel_array': (calibrate_taxels, write_taxel_scene, 'plate', 20.0),
             'force_taxels': (calibrate_weights, write_vector_scene, 'uskin_weights', 50.0)}


def calibrate_specimen(sensor_type: str, output: Path) -> str:
    """Simulate the calibration scene of a sensor type of SPECIMENS, calibrate, and write the calibration to output; the report."""
    calibrate, write, scene, rate = SPECIMENS[sensor_type]
    with TemporaryDirectory() as folder:
        bag = Path(folder) / sensor_type
        write(bag, scene, rate)
        reported = calibrate([bag], Path(share('params', f'{sensor_type}_sim.yaml')), output)
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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate: fits the model of a sensor to recordings of presses at known positions (ground_truth/contacts), and writes its calibration
file."""
from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tactile_driver.errors import tells_errors
from tactile_driver.recordings.reader import descriptions

from ..bags.replay import SENSOR_TYPE
from ..finger.model import SENSOR as PSD_FINGER
from ..taxel.response import SENSOR as TAXEL_ARRAY
from ..errors import BadArgument
from ..press.tools import calibrate_markers
from ..press.sensor import MARKER_SENSORS
from ..parameters.file import read_parameters
from ..finger.tools import calibrate_psd
from ..gel.pins import SENSOR as PIN_DOME
from ..gel.tools import calibrate_pins
from ..taxel.tools import calibrate_taxels
from ..touchpad.tools import calibrate_touchpad


def calibrator(sensor_type: str, sphere_radius: float | None = None, plate: Path | None = None) -> Callable[..., str]:
    """The calibration function of a sensor type: called with (bags, params, output, namespace, serial) it writes output and a plot of the
    residuals beside it, and returns a report.

    Raises BadArgument for an unknown type, for a sphere_radius (m) of a sensor other than a touchpad, and for a plate of one that is no
    sheet.
    """
    if plate is not None and not (sensor_type in MARKER_SENSORS and MARKER_SENSORS[sensor_type].is_sheet):
        raise BadArgument(f'--plate is for sheets; the parameter file is of a {sensor_type}')
    if sensor_type == 'touchpad':
        return partial(calibrate_touchpad, sphere_radius=sphere_radius)
    if sphere_radius is not None:
        raise BadArgument(f'--sphere-radius is for touchpads; the parameter file is of a {sensor_type}')
    if sensor_type in MARKER_SENSORS:
        return partial(calibrate_markers, plate=plate)
    others = {PSD_FINGER: calibrate_psd, TAXEL_ARRAY: calibrate_taxels, PIN_DOME: calibrate_pins}
    if sensor_type in others:
        return others[sensor_type]
    raise BadArgument(f'sensor_type {sensor_type} cannot be calibrated; these can: {", ".join(["touchpad", *MARKER_SENSORS, *others])}')


def recorded_serial(bag: Path) -> str:
    """The serial number of the device in the recorded description; '' when unknown."""
    return next((str(about['serial']) for about in descriptions(bag) if about.get('serial')), '')


@tells_errors('calibrate')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='calibrate', description=__doc__)
    parser.add_argument('bags', type=Path, nargs='+', metavar='BAG',
                        help='rosbag2 recording with images, camera_info (or voltages), ground_truth/contacts; for forces '
                        'ground_truth/wrench')
    parser.add_argument('--params', type=Path, required=True, help='parameter file of the sensor, as the launch file takes it')
    parser.add_argument('--output', type=Path, required=True, help='calibration file to write')
    parser.add_argument('--sphere-radius', type=float, help='touchpad: radius of the sphere, m; default: it is fitted too')
    parser.add_argument('--plate', type=Path, metavar='BAG', help="sheet: recording of a flat plate that is pressed onto all markers in "
                        "steps of a millimetre, for the paper's method")
    parser.add_argument('--namespace', default='', help='namespace of the sensor; needed when a recording has several sensors')
    parser.add_argument('--serial', default='', help='serial number for the file; default: the one in the recording')
    given = parser.parse_args(args)
    sensor_type = read_parameters(given.params, 'dot_tracker_node', SENSOR_TYPE)['sensor_type']
    serial = given.serial or recorded_serial(given.bags[0])
    print(calibrator(sensor_type, given.sphere_radius, given.plate)(given.bags, given.params, given.output, given.namespace, serial))
    return 0

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate: fits the model of a sensor to recordings of presses at known positions (ground_truth/contacts), and writes its calibration
file."""
from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tactile_driver.errors import reports_errors
from tactile_driver.recordings.reader import descriptions

from ..bags.replay import read_sensor_type
from ..core.errors import BadArgument, by_name
from ..core.sensor_type import SENSOR_TYPES

_OPTIONS = {'sphere_radius': '--sphere-radius', 'plate': '--plate', 'weight': '--weight'}


def calibrator(sensor_type: str, **options: object) -> Callable[..., str]:
    """The calibration function of a sensor type.

    Parameters
    ----------
    sensor_type : str
        Name of the sensor type.
    **options
        `sphere_radius` in m, `plate`, a bag, `weight` in N; None for those that are not given.

    Returns
    -------
    callable
        Function of (bags, params, output, namespace, serial) that writes the file `output` and a plot of the residuals beside it, and
        returns a report.

    Raises
    ------
    BadArgument
        For a type that is unknown or is not calibrated, and for an option of another type.
    """
    kind = by_name(SENSOR_TYPES, sensor_type, 'sensor_type')
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in kind.calibrate_options:
            takes = [other for other, row in SENSOR_TYPES.items() if name in row.calibrate_options]
            raise BadArgument(f'{_OPTIONS[name]} is an option for {", ".join(takes)}; the parameter file is of a {sensor_type}')
    if kind.calibrator is None:
        can = [name for name, row in SENSOR_TYPES.items() if row.calibrate]
        raise BadArgument(f'sensor_type {sensor_type} cannot be calibrated; these can: {", ".join(can)}')
    return partial(kind.calibrator, **given)


def recorded_serial(bag: Path) -> str:
    """The serial number of the device in the recorded description; '' when unknown."""
    return next((str(about['serial']) for about in descriptions(bag) if about.get('serial')), '')


@reports_errors('calibrate')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='calibrate', description=__doc__)
    parser.add_argument('bags', type=Path, nargs='+', metavar='BAG',
                        help='rosbag2 recording with images, camera_info (or voltages), ground_truth/contacts; for forces '
                        'ground_truth/wrench')
    parser.add_argument('--params', type=Path, required=True, help='parameter file of the sensor, as the launch file takes it')
    parser.add_argument('--output', type=Path, required=True, help='calibration file to write')
    parser.add_argument('--sphere-radius', type=float,
                        help='radius of the sphere, m; touchpad: without it, it is fitted too; photometric_gel: for depth')
    parser.add_argument('--plate', type=Path, metavar='BAG', help="sheet: recording of a flat plate that is pressed onto all markers in "
                        "steps of a millimetre, for the paper's method")
    parser.add_argument('--weight', type=float, metavar='NEWTONS', help='force of the weight in each recording (1 kg: 9.81 N), where '
                        'ground_truth/wrench is not recorded')
    parser.add_argument('--namespace', default='', help='namespace of the sensor; needed when a recording has several sensors')
    parser.add_argument('--serial', default='', help='serial number for the file; default: the one in the recording')
    given = parser.parse_args(args)
    make = calibrator(read_sensor_type(given.params), sphere_radius=given.sphere_radius, plate=given.plate, weight=given.weight)
    serial = given.serial or recorded_serial(given.bags[0])
    print(make(given.bags, given.params, given.output, given.namespace, serial))
    return 0

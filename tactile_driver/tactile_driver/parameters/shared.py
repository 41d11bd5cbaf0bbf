# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters that the drivers of all sensors have, and the checks across them."""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from .table import Parameter

SCENE = Parameter('scene', str, 'demo', '', 'source sim: name of the scene; an unknown name lists all names')
SEED = Parameter('seed', int, 0, '', 'source sim: seed of the noise and of the manufacturing tolerances of the sensor', 0, 2**31 - 1)
#: names of the parameters that may be changed while a driver is active
LIVE = frozenset({'exposure'})
AUTOSTART = Parameter('autostart', bool, True, '', 'configure and activate at start, retry while the device is missing', read_only=True)
SERIAL_DEVICE = Parameter('device', str, '', '', 'source device: path, name under /dev/serial/by-id, or part of a USB serial number')


def sensor_parameters(sensor_type: str) -> tuple[Parameter, Parameter]:
    """frame_id and sensor_type, with the sensor type as default of both."""
    return (Parameter('frame_id', str, sensor_type, '', 'sensor frame; images and camera_info are in <frame_id>_camera_optical'),
            Parameter('sensor_type', str, sensor_type, '', 'sensor type, published in the description'))


def check_together(values: Mapping) -> None:
    """Check what depends on several parameters of a driver. Raises BadArgument."""
    if values['source'] in ('file', 'bag') and not values['path']:
        raise BadArgument(f'parameter path is empty, but source {values["source"]} needs the path of a recording')
    if -1 < values['rate'] < 0:
        raise BadArgument(f'parameter rate is {values["rate"]}, but must be -1, 0 or a rate above 0 Hz')
    if not values['frame_id']:
        raise BadArgument('parameter frame_id is empty; name the sensor frame')

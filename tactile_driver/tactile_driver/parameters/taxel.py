# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of taxel_array_node."""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from ..serial_frames.binary import LARGEST
from ..sources.taxel.registry import TAXEL_SOURCES
from .table import Parameter

TAXEL_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'where images come from: simulated array, serial port, .npz, .npy or .csv file, rosbag2 recording',
              choices=tuple(TAXEL_SOURCES)),
    Parameter('device', str, '', '', 'device: path, name under /dev/serial/by-id, or part of a USB serial number'),
    Parameter('baud', int, 12000000, '1/s', 'device: bits a second', 300, 20_000_000),
    Parameter('path', str, '', '', 'file, bag: the file or the rosbag2 folder'),
    Parameter('topic', str, '', '', 'bag: the topic with the images; file: the array in an .npz; empty where there is only one'),
    Parameter('scene', str, 'demo', '', 'sim: the scene; an unknown name is answered with those that exist'),
    Parameter('seed', int, 0, '', 'sim: of the noise and of the irregularities of the specimen', 0, 2**31 - 1),
    Parameter('rate', float, -1.0, 'Hz', "-1: the source's own (sim 100); file, bag: 0 for as fast as it is consumed", -1.0, 20000.0),
    Parameter('loop', bool, False, '', 'file, bag: start again at the end (sim always does)'),
    Parameter('rows', int, 44, '', 'of taxels, as published', 1, LARGEST),
    Parameter('columns', int, 44, '', 'of taxels, as published', 1, LARGEST),
    Parameter('transposed', bool, False, '', 'device, file, bag: what comes as a row is a column'),
    Parameter('flip_rows', bool, False, '', 'device, file, bag: the last row comes first (after transposed)'),
    Parameter('flip_columns', bool, False, '', 'device, file, bag: the last column comes first'),
    Parameter('frame_id', str, 'taxel_array', '', 'the sensor frame, in every header'),
    Parameter('sensor_type', str, 'taxel_array', '', 'kind of sensor, in the description'),
    Parameter('autostart', bool, True, '', 'configure and activate by itself, and again while the device is missing', read_only=True),
)


def check_together(values: Mapping) -> None:
    """What one parameter alone cannot tell. Raises BadArgument."""
    if values['source'] in ('bag', 'file') and not values['path']:
        raise BadArgument(f'parameter path is empty, but source {values["source"]} needs the path of a recording')
    if -1 < values['rate'] < 0:
        raise BadArgument(f'parameter rate is {values["rate"]}, but must be -1, 0 or a rate above 0 Hz')
    if not values['frame_id']:
        raise BadArgument('parameter frame_id is empty; name the sensor frame')

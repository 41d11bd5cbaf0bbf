# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of psd_node."""
from __future__ import annotations

from collections.abc import Mapping

from ..errors import BadArgument
from ..sources.psd.registry import PSD_SOURCES
from ..sources.psd.serial import FORMATS
from .table import Parameter

PSD_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'where samples come from: simulated finger, serial port, rosbag2 recording',
              choices=tuple(PSD_SOURCES)),
    Parameter('device', str, '', '', 'device: path, name under /dev/serial/by-id, or part of a USB serial number'),
    Parameter('baud', int, 921600, '1/s', 'device: bits a second', 300, 20_000_000),
    Parameter('format', str, 'binary', '', 'device: what comes, see doc/serial_protocol.md', choices=FORMATS),
    Parameter('adc.full_scale', float, 5.0, 'V', "of the converter: what its count 2**bits would be", 1e-3, 1e3),
    Parameter('adc.bits', int, 12, '', 'of the converter; binary frames tell it themselves', 8, 16),
    Parameter('saturation', float, 4.9, 'V', 'from which an output tells no more, for /diagnostics', 1e-3, 1e3),
    Parameter('batch_period', float, 0.005, 's', 'device, sim: a message holds what came within it', 0.001, 0.05),
    Parameter('path', str, '', '', 'bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'bag: the topic with the voltages; empty where the bag has only one'),
    Parameter('scene', str, 'demo', '', 'sim: the scene; an unknown name is answered with those that exist'),
    Parameter('seed', int, 0, '', 'sim: of the noise and of the irregularities of the specimen', 0, 2**31 - 1),
    Parameter('rate', float, -1.0, 'Hz', "-1: the source's own; sim: samples (1000); bag: messages, 0 for as fast as they are consumed",
              -1.0, 20000.0),
    Parameter('loop', bool, False, '', 'bag: start again at the end (sim always does)'),
    Parameter('frame_id', str, 'psd_finger', '', 'the sensor frame, in every header'),
    Parameter('sensor_type', str, 'psd_finger', '', 'kind of sensor, in the description'),
    Parameter('autostart', bool, True, '', 'configure and activate by itself, and again while the device is missing', read_only=True),
)


def check_together(values: Mapping) -> None:
    """What one parameter alone cannot tell. Raises BadArgument."""
    if values['source'] == 'bag' and not values['path']:
        raise BadArgument('parameter path is empty, but source bag needs the path of a recording')
    if -1 < values['rate'] < 0:
        raise BadArgument(f'parameter rate is {values["rate"]}, but must be -1, 0 or a rate above 0 Hz')
    if not values['frame_id']:
        raise BadArgument('parameter frame_id is empty; name the sensor frame')

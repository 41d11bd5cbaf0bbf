# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of psd_node."""
from __future__ import annotations

from .shared import AUTOSTART, SCENE, SEED, SERIAL_DEVICE, sensor_parameters
from ..sources.registry import PSD_SOURCES
from ..sources.psd.serial import FORMATS
from .table import Parameter

PSD_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the samples: sim (simulated finger), device (serial port) or bag (rosbag2 recording)',
              choices=tuple(PSD_SOURCES)),
    SERIAL_DEVICE,
    Parameter('baud', int, 921600, 'bit/s', 'source device: baud rate', 300, 20_000_000),
    Parameter('format', str, 'binary', '', 'source device: format of the stream, see doc/serial_protocol.md', choices=FORMATS),
    Parameter('adc.full_scale', float, 5.0, 'V', 'source device: voltage that the count 2**bits of the converter would mean', 1e-3, 1e3),
    Parameter('adc.bits', int, 12, '', 'source device, format csv: resolution of the converter; binary frames state it', 8, 16),
    Parameter('modulation', bool, False, '',
              "source device: the finger's light is on in every second sample, and a fifth column tells which; "
              'the dark samples are subtracted and half as many net samples published'),
    Parameter('saturation', float, 4.9, 'V', 'voltage from which an output counts as saturated in /diagnostics', 1e-3, 1e3),
    Parameter('batch_period', float, 0.005, 's', 'sources device and sim: time that the samples of one message span', 0.001, 0.05),
    Parameter('path', str, '', '', 'source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source bag: the topic with the voltages; empty if the bag has only one'),
    SCENE,
    SEED,
    Parameter('rate', float, -1.0, 'Hz', "sim: sample rate; bag: message rate, 0: as fast as subscribers receive; -1: the source's own "
              "(sim: 1000)", -1.0, 20000.0),
    Parameter('loop', bool, False, '', 'source bag: restart at the end (sim always does)'),
    *sensor_parameters('psd_finger'),
    AUTOSTART,
)

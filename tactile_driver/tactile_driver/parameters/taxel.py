# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters of taxel_array_node."""
from __future__ import annotations

from ..serial_frames.binary import LARGEST
from .shared import AUTOSTART, SCENE, SEED, SERIAL_DEVICE, sensor_parameters
from ..sources.registry import TAXEL_SOURCES
from .table import Parameter

TAXEL_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the images: sim (simulated array), device (serial port), file (.npz, .npy or .csv) or '
              'bag (rosbag2 recording)', choices=tuple(TAXEL_SOURCES)),
    SERIAL_DEVICE,
    Parameter('baud', int, 12000000, 'bit/s', 'source device: baud rate', 300, 20_000_000),
    Parameter('path', str, '', '', 'source file: the file; source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source bag: the image topic; source file: the array in an .npz; empty if there is only one'),
    SCENE,
    SEED,
    Parameter('rate', float, -1.0, 'Hz', "frame rate; -1: the source's own (sim: 100 Hz); sources file and bag, 0: as fast as subscribers "
              'receive', -1.0, 20000.0),
    Parameter('loop', bool, False, '', 'sources file and bag: restart at the end (sim always does)'),
    Parameter('rows', int, 44, '', 'rows of taxels in the published image', 1, LARGEST),
    Parameter('columns', int, 44, '', 'columns of taxels in the published image', 1, LARGEST),
    Parameter('transposed', bool, False, '', 'sources device, file and bag: exchange rows and columns'),
    Parameter('flip_rows', bool, False, '', 'sources device, file and bag: reverse the order of the rows (after transposed)'),
    Parameter('flip_columns', bool, False, '', 'sources device, file and bag: reverse the order of the columns (after transposed)'),
    *sensor_parameters('taxel_array'),
    AUTOSTART,
)

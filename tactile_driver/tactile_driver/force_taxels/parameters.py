# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The parameters and sources of force_taxel_node. No ROS here."""
from __future__ import annotations

from ..parameters.drivers import AUTOSTART, PLAYED_FRAMES, SERIAL_DEVICE, STAY, sensor_parameters
from ..parameters.table import Parameter
from ..plugins import PluginTable
from ..sources.registry import Sources

FORCE_TAXEL_SOURCES: Sources = PluginTable('tactile_driver.force_taxel_sources', {
    'sim': 'tactile_driver.force_taxels.sources:VectorSimulatedSource', 'device': 'tactile_driver.force_taxels.sources:VectorSerialSource',
    'file': 'tactile_driver.force_taxels.sources:VectorFileSource', 'bag': 'tactile_driver.force_taxels.bag:VectorBagSource'})

FORCE_TAXEL_DRIVER_PARAMETERS = (
    Parameter('source', str, 'sim', '', 'origin of the vectors: sim (simulated device), device (serial port), topics (Float32MultiArray), '
              'file (.npz, .npy or .csv) or bag (rosbag2 recording)', choices=FORCE_TAXEL_SOURCES.extended({'topics': None})),
    SERIAL_DEVICE,
    Parameter('baud', int, 921600, 'bit/s', 'source device: baud rate', 300, 20_000_000),
    Parameter('layout', str, '', '', 'sources device, topics and file, and a bag of Float32MultiArray: YAML file with the positions of the '
              'taxels'),
    Parameter('path', str, '', '', 'source file: the file; source bag: the rosbag2 folder'),
    Parameter('topic', str, '', '', 'source topics: the topic; source bag: the topic; source file: the array in an .npz; empty if there is '
              'only one'),
    Parameter('columns', str, '', '', 'source file: regular expression of the names of the columns with the numbers of the taxels; empty: '
              'all'),
    *PLAYED_FRAMES,
    *sensor_parameters('force_taxels'),
    STAY,
    AUTOSTART,
)

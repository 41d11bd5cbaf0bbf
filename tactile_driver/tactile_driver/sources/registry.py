# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sources of all drivers by name, made from a node's parameters. A process imports only the source that it uses."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from pkgutil import resolve_name

from ..errors import by_name
from .source import Clock, Source

#: Name of a source -> what makes it, not yet open, of the node's parameters and its clock, or where that is, as module:name.
Sources = dict[str, Callable[[Mapping, Clock], Source] | str]

CAMERA_SOURCES: Sources = {
    'sim': 'tactile_driver.camera.simulated:SimulatedSource', 'device': 'tactile_driver.camera.device:DeviceSource',
    'file': 'tactile_driver.camera.file:FileSource', 'bag': 'tactile_driver.sources.bag:BagSource'}


def _paired(values: Mapping, clock: Clock) -> Source:
    from ..camera.pairs import PairedSource
    right = {**values, 'device': values['right_device'], 'path': values['right_path'] or values['path'], 'topic': values['right_topic']}
    return PairedSource(*(make_source(CAMERA_SOURCES, each, clock) for each in (values, right)), values['max_skew'])


DUAL_CAMERA_SOURCES: Sources = {
    'sim': 'tactile_driver.camera.simulated:DualSimulatedSource', 'device': _paired,
    'file': 'tactile_driver.camera.file:TwoFilesSource', 'bag': _paired}
PSD_SOURCES: Sources = {
    'sim': 'tactile_driver.serial.psd:PsdSimulatedSource', 'device': 'tactile_driver.serial.psd:PsdSerialSource',
    'bag': 'tactile_driver.sources.bag:PsdBagSource'}
TAXEL_SOURCES: Sources = {
    'sim': 'tactile_driver.serial.taxel:TaxelSimulatedSource', 'device': 'tactile_driver.serial.taxel:TaxelSerialSource',
    'file': 'tactile_driver.serial.taxel:TaxelFileSource', 'bag': 'tactile_driver.sources.bag:TaxelBagSource'}
#: sources of nodes with one or two cameras; topics are subscribed to by the nodes themselves
CAMERA_CHOICES = (*CAMERA_SOURCES, 'topics')


def make_source(sources: Sources, values: Mapping, clock: Clock) -> Source:
    """The source of these that values['source'] names, not yet open; values: the node's parameters. Raises BadArgument, listing the names,
    for an unknown one."""
    make = by_name(sources, values['source'], 'source')
    return (resolve_name(make) if isinstance(make, str) else make)(values, clock)

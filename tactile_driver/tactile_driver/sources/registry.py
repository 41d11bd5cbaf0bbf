# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of the sources of all drivers, by name. A process imports only the source that it uses.

Other packages add sources by entry points (docs/extending.md).
"""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..errors import by_name
from ..plugins import PluginTable
from .source import Clock, Source

#: Name of a source -> function of (parameters of the node, its clock) that makes it, not yet open.
Sources = Mapping[str, Callable[[Mapping, Clock], Source]]

CAMERA_SOURCES: Sources = PluginTable('tactile_driver.camera_sources', {
    'sim': 'tactile_driver.camera.simulated:SimulatedSource', 'device': 'tactile_driver.camera.device:DeviceSource',
    'file': 'tactile_driver.camera.file:FileSource', 'bag': 'tactile_driver.sources.bag:BagSource'})


def _paired(values: Mapping, clock: Clock) -> Source:
    from ..camera.pairs import PairedSource
    right = {**values, 'device': values['right_device'], 'path': values['right_path'] or values['path'], 'topic': values['right_topic']}
    return PairedSource(*(make_source(CAMERA_SOURCES, each, clock) for each in (values, right)), values['max_skew'])


DUAL_CAMERA_SOURCES: Sources = PluginTable('tactile_driver.dual_camera_sources', {
    'sim': 'tactile_driver.camera.simulated:DualSimulatedSource', 'device': _paired,
    'file': 'tactile_driver.camera.file:TwoFilesSource', 'bag': _paired})
PSD_SOURCES: Sources = PluginTable('tactile_driver.psd_sources', {
    'sim': 'tactile_driver.serial.psd:PsdSimulatedSource', 'device': 'tactile_driver.serial.psd:PsdSerialSource',
    'bag': 'tactile_driver.sources.bag:PsdBagSource'})
TAXEL_SOURCES: Sources = PluginTable('tactile_driver.taxel_sources', {
    'sim': 'tactile_driver.serial.taxel:TaxelSimulatedSource', 'device': 'tactile_driver.serial.taxel:TaxelSerialSource',
    'file': 'tactile_driver.serial.taxel:TaxelFileSource', 'bag': 'tactile_driver.sources.bag:TaxelBagSource'})
#: Names of the sources of nodes that subscribe to topics themselves, too.
CAMERA_CHOICES, DUAL_CAMERA_CHOICES = (table.extended({'topics': None}) for table in (CAMERA_SOURCES, DUAL_CAMERA_SOURCES))


def make_source(sources: Sources, values: Mapping, clock: Clock) -> Source:
    """Make the source that the parameter ``source`` names; it is not open yet.

    Parameters
    ----------
    sources : Mapping
        Table of sources, such as ``TAXEL_SOURCES``.
    values : Mapping
        Parameters of the node.
    clock : callable
        Clock of the stamps, in ns.

    Returns
    -------
    Source
        The source.

    Raises
    ------
    BadArgument
        If the name is unknown; the message lists the names.
    """
    return by_name(sources, values['source'], 'source')(values, clock)

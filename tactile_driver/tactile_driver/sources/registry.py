# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sources of all drivers by name, made from a node's parameters. A process imports only the source that it uses."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module

from ..camera.controls import CONTROLS
from ..errors import BadArgument
from .source import Clock, Source

#: Name of a source -> function that makes it, not yet open, of the node's parameters and its clock.
Sources = dict[str, Callable[[Mapping, Clock], Source]]


def _played(values: Mapping) -> tuple:
    return tuple(values[name] for name in ('path', 'topic', 'rate', 'loop'))


def _simulated(values: Mapping) -> tuple:
    return tuple(values[name] for name in ('scene', 'rate', 'seed'))


def _of(module: str, make: Callable[[object, Mapping, Clock], Source]) -> Callable[[Mapping, Clock], Source]:
    """What makes a source by make(module, values, clock); the module, of tactile_driver, is imported then."""
    return lambda values, clock: make(import_module(f'tactile_driver.{module}'), values, clock)


def _camera_device(module, values: Mapping, clock: Clock) -> Source:
    controls = {name: values[name] for name in CONTROLS}
    settings = module.DeviceSettings(*(values[name] for name in ('width', 'height', 'rate', 'pixel_format')), controls)
    return module.DeviceSource(values['device'], settings, clock)


def _psd_device(module, values: Mapping, clock: Clock) -> Source:
    names = ('format', 'baud', 'adc.full_scale', 'adc.bits', 'batch_period', 'modulation', 'saturation')
    return module.PsdSerialSource(values['device'], module.SerialSettings(*(values[name] for name in names)), clock)


def _shape(values: Mapping) -> tuple[int, int]:
    """(rows, columns) as the device sends them."""
    shape = values['rows'], values['columns']
    return shape[::-1] if values['transposed'] else shape


CAMERA_SOURCES: Sources = {
    'sim': _of('camera.simulated', lambda module, v, clock: module.SimulatedSource(*_simulated(v), (v['width'], v['height']), clock)),
    'device': _of('camera.device', _camera_device),
    'file': _of('camera.file', lambda module, v, clock: module.FileSource(v['path'], v['rate'], v['loop'], clock)),
    'bag': _of('sources.bag', lambda module, v, _: module.BagSource(*_played(v)))}
PSD_SOURCES: Sources = {
    'sim': _of('serial.psd', lambda module, v, clock: module.PsdSimulatedSource(*_simulated(v), v['batch_period'], clock)),
    'device': _of('serial.psd', _psd_device),
    'bag': _of('sources.bag', lambda module, v, _: module.PsdBagSource(*_played(v)))}
TAXEL_SOURCES: Sources = {
    'sim': _of('serial.taxel', lambda module, v, clock: module.TaxelSimulatedSource(*_simulated(v), clock)),
    'device': _of('serial.taxel', lambda module, v, clock: module.TaxelSerialSource(v['device'], v['baud'], _shape(v), clock)),
    'file': _of('serial.taxel', lambda module, v, clock: module.TaxelFileSource(*_played(v), _shape(v), clock)),
    'bag': _of('sources.bag', lambda module, v, _: module.TaxelBagSource(*_played(v), _shape(v)))}
#: sources of nodes with one or two cameras; topics are subscribed to by the nodes themselves
CAMERA_CHOICES = ('sim', 'device', 'file', 'bag', 'topics')


def make_source(sources: Sources, values: Mapping, clock: Clock) -> Source:
    """The source of these that values['source'] names, not yet open; values: the node's parameters. Raises BadArgument, listing the names,
    for an unknown one."""
    if values['source'] not in sources:
        raise BadArgument(f'source: {values["source"]!r} is unknown; choose one of {", ".join(sources)}')
    return sources[values['source']](values, clock)


def make_dual_source(values: Mapping, clock: Clock, make_topic: Callable[[str], Source]) -> Source:
    """As make_source, for two cameras, of CAMERA_CHOICES; its frames are PairFrames. make_topic: makes the source of one image topic."""
    from ..camera.pairs import PairedSource
    name = values['source']
    if name == 'sim':
        from ..camera.simulated import DualSimulatedSource
        return DualSimulatedSource(*_simulated(values), clock)
    if name == 'topics':
        return PairedSource(make_topic(values['topic']), make_topic(values['right_topic']), values['max_skew'])
    if name not in CAMERA_CHOICES:
        raise BadArgument(f'source: {name!r} is unknown; choose one of {", ".join(CAMERA_CHOICES)}')
    if name == 'file':
        from ..camera.file import TwoFilesSource
        return TwoFilesSource(values['path'], values['right_path'], values['rate'], values['loop'], clock)
    right = {**values, 'device': values['right_device'], 'path': values['right_path'] or values['path'], 'topic': values['right_topic']}
    return PairedSource(CAMERA_SOURCES[name](values, clock), CAMERA_SOURCES[name](right, clock), values['max_skew'])

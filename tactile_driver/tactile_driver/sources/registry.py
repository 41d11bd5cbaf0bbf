# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sources of all drivers by name, made from a node's parameters. A process imports only the source that it uses."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..errors import BadArgument
from .source import Clock, Source

#: Name of a source -> function that makes it, not yet open, of the node's parameters and its clock.
Sources = dict[str, Callable[[Mapping, Clock], Source]]


def _played(values: Mapping) -> tuple:
    return tuple(values[name] for name in ('path', 'topic', 'rate', 'loop'))


def _simulated(values: Mapping) -> tuple:
    return tuple(values[name] for name in ('scene', 'rate', 'seed'))


def _camera_device(values: Mapping, clock: Clock) -> Source:
    from ..camera.device import DeviceSettings, DeviceSource
    from ..camera.controls import CONTROLS
    names = ('width', 'height', 'rate', 'pixel_format')
    controls = {name: values[name] for name in CONTROLS}
    return DeviceSource(values['device'], DeviceSettings(*(values[name] for name in names), controls), clock)


def _camera_file(values: Mapping, clock: Clock) -> Source:
    from ..camera.file import FileSource
    return FileSource(values['path'], values['rate'], values['loop'], clock)


def _camera_bag(values: Mapping, clock: Clock) -> Source:
    from .bag import BagSource
    return BagSource(*_played(values))


def _camera_simulated(values: Mapping, clock: Clock) -> Source:
    from ..camera.simulated import SimulatedSource
    return SimulatedSource(*_simulated(values), (values['width'], values['height']), clock)


def _psd_device(values: Mapping, clock: Clock) -> Source:
    from ..serial.psd import PsdSerialSource, SerialSettings
    names = ('format', 'baud', 'adc.full_scale', 'adc.bits', 'batch_period', 'modulation', 'saturation')
    return PsdSerialSource(values['device'], SerialSettings(*(values[name] for name in names)), clock)


def _psd_bag(values: Mapping, clock: Clock) -> Source:
    from .bag import PsdBagSource
    return PsdBagSource(*_played(values))


def _psd_simulated(values: Mapping, clock: Clock) -> Source:
    from ..serial.psd import PsdSimulatedSource
    return PsdSimulatedSource(*_simulated(values), values['batch_period'], clock)


def _shape(values: Mapping) -> tuple[int, int]:
    """(rows, columns) as the device sends them."""
    shape = values['rows'], values['columns']
    return shape[::-1] if values['transposed'] else shape


def _taxel_device(values: Mapping, clock: Clock) -> Source:
    from ..serial.taxel import TaxelSerialSource
    return TaxelSerialSource(values['device'], values['baud'], _shape(values), clock)


def _taxel_file(values: Mapping, clock: Clock) -> Source:
    from ..serial.taxel import TaxelFileSource
    return TaxelFileSource(*_played(values), _shape(values), clock)


def _taxel_bag(values: Mapping, clock: Clock) -> Source:
    from .bag import TaxelBagSource
    return TaxelBagSource(*_played(values), _shape(values))


def _taxel_simulated(values: Mapping, clock: Clock) -> Source:
    from ..serial.taxel import TaxelSimulatedSource
    return TaxelSimulatedSource(*_simulated(values), clock)


CAMERA_SOURCES: Sources = {'sim': _camera_simulated, 'device': _camera_device, 'file': _camera_file, 'bag': _camera_bag}
PSD_SOURCES: Sources = {'sim': _psd_simulated, 'device': _psd_device, 'bag': _psd_bag}
TAXEL_SOURCES: Sources = {'sim': _taxel_simulated, 'device': _taxel_device, 'file': _taxel_file, 'bag': _taxel_bag}
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

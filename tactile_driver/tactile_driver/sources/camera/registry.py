# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Creates a camera source by name from a node's parameters; imports only the source in use."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..base.protocol import Clock, Source
from ...errors import BadArgument


def _device(values: Mapping, clock: Clock) -> Source:
    from .device import DeviceSettings, DeviceSource
    names = ('width', 'height', 'rate', 'pixel_format', 'exposure')
    return DeviceSource(values['device'], DeviceSettings(*(values[name] for name in names)), clock)


def _file(values: Mapping, clock: Clock) -> Source:
    from .file import FileSource
    return FileSource(values['path'], values['rate'], values['loop'], clock)


def _bag(values: Mapping, clock: Clock) -> Source:
    from .bag import BagSource
    return BagSource(values['path'], values['topic'], values['rate'], values['loop'])


def _simulated(values: Mapping, clock: Clock) -> Source:
    from .simulated import SimulatedSource
    return SimulatedSource(values['scene'], values['rate'], values['seed'], (values['width'], values['height']), clock)


SOURCES: dict[str, Callable[[Mapping, Clock], Source]] = {'sim': _simulated, 'device': _device, 'file': _file, 'bag': _bag}


def make_source(values: Mapping, clock: Clock) -> Source:
    """The source named by values['source'], not yet open; values: parameters of the camera node. Raises BadArgument, listing the names,
    for an unknown one."""
    if values['source'] not in SOURCES:
        raise BadArgument(f'source: {values["source"]!r} is unknown; choose one of {", ".join(SOURCES)}')
    return SOURCES[values['source']](values, clock)

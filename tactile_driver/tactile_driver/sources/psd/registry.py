# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sources of a PSD finger by name, made from a node's parameters. A process imports only the source that it uses."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..base.protocol import Clock, Source
from ...errors import BadArgument


def _device(values: Mapping, clock: Clock) -> Source:
    from .serial import PsdSerialSource, SerialSettings
    names = ('format', 'baud', 'adc.full_scale', 'adc.bits', 'batch_period', 'modulation', 'saturation')
    return PsdSerialSource(values['device'], SerialSettings(*(values[name] for name in names)), clock)


def _bag(values: Mapping, clock: Clock) -> Source:
    from .bag import PsdBagSource
    return PsdBagSource(values['path'], values['topic'], values['rate'], values['loop'])


def _simulated(values: Mapping, clock: Clock) -> Source:
    from .simulated import PsdSimulatedSource
    return PsdSimulatedSource(values['scene'], values['rate'], values['seed'], values['batch_period'], clock)


PSD_SOURCES: dict[str, Callable[[Mapping, Clock], Source]] = {'sim': _simulated, 'device': _device, 'bag': _bag}


def make_psd_source(values: Mapping, clock: Clock) -> Source:
    """The source that values['source'] names, not yet open; values: psd_node's parameters. Raises BadArgument, listing the names."""
    if values['source'] not in PSD_SOURCES:
        raise BadArgument(f'source: {values["source"]!r} is unknown; choose one of {", ".join(PSD_SOURCES)}')
    return PSD_SOURCES[values['source']](values, clock)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sources of a taxel array by name, made from a node's parameters. A process imports only the source that it uses."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..base.protocol import Clock, Source
from ...errors import BadArgument


def _shape(values: Mapping) -> tuple[int, int]:
    """As the device sends it."""
    shape = values['rows'], values['columns']
    return shape[::-1] if values['transposed'] else shape


def _device(values: Mapping, clock: Clock) -> Source:
    from .serial import TaxelSerialSource
    return TaxelSerialSource(values['device'], values['baud'], _shape(values), clock)


def _file(values: Mapping, clock: Clock) -> Source:
    from .file import TaxelFileSource
    return TaxelFileSource(values['path'], values['topic'], values['rate'], values['loop'], _shape(values), clock)


def _bag(values: Mapping, clock: Clock) -> Source:
    from .bag import TaxelBagSource
    return TaxelBagSource(values['path'], values['topic'], values['rate'], values['loop'], _shape(values))


def _simulated(values: Mapping, clock: Clock) -> Source:
    from .simulated import TaxelSimulatedSource
    return TaxelSimulatedSource(values['scene'], values['rate'], values['seed'], clock)


TAXEL_SOURCES: dict[str, Callable[[Mapping, Clock], Source]] = {'sim': _simulated, 'device': _device, 'file': _file, 'bag': _bag}


def make_taxel_source(values: Mapping, clock: Clock) -> Source:
    """The source that values['source'] names, not yet open; values: taxel_array_node's parameters. Raises BadArgument, listing the
    names."""
    if values['source'] not in TAXEL_SOURCES:
        raise BadArgument(f'source: {values["source"]!r} is unknown; choose one of {", ".join(TAXEL_SOURCES)}')
    return TAXEL_SOURCES[values['source']](values, clock)

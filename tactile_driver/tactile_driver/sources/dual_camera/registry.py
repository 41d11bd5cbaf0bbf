# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The sources of two cameras by name, made from a node's parameters. A process imports only the source that it uses."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..base.protocol import Clock, Source
from ..camera.registry import SOURCES
from ...errors import BadArgument
from .pairs import DualSource, PairedSource, SplitSource

LAYOUTS = ('two', 'side_by_side')
DUAL_SOURCES = ('sim', 'device', 'file', 'bag', 'topics')


def _of_right(values: Mapping) -> dict:
    """The parameters as the right camera's source reads them."""
    return {**values, 'device': values['right_device'], 'path': values['right_path'] or values['path'], 'topic': values['right_topic']}


def make_dual_source(values: Mapping, clock: Clock, make_topic: Callable[[str], Source]) -> DualSource:
    """The source that values['source'] names, not yet open; values: the dual camera node's parameters; make_topic: makes the source of
    one image topic's messages. Raises BadArgument, listing the names."""
    name = values['source']
    if name not in DUAL_SOURCES:
        raise BadArgument(f'source: {name!r} is unknown; choose one of {", ".join(DUAL_SOURCES)}')
    if name == 'sim':
        from ..camera.simulated import DualSimulatedSource
        return DualSimulatedSource(values['scene'], values['rate'], values['seed'], clock)
    if name == 'topics':
        return PairedSource(make_topic(values['topic']), make_topic(values['right_topic']), values['max_skew'])
    if values['layout'] == 'side_by_side':
        return SplitSource(SOURCES[name](values, clock))
    if name == 'file':
        from .file import TwoFilesSource
        return TwoFilesSource(values['path'], values['right_path'], values['rate'], values['loop'], clock)
    return PairedSource(SOURCES[name](values, clock), SOURCES[name](_of_right(values), clock), values['max_skew'])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Creates a dual-camera source by name from a node's parameters; imports only the source in use."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..base.protocol import Clock, Source
from ..camera.registry import SOURCES
from ...errors import BadArgument
from .pairs import DualSource, PairedSource, SplitSource

LAYOUTS = ('two', 'side_by_side')
DUAL_SOURCES = ('sim', 'device', 'file', 'bag', 'topics')


def _of_right(values: Mapping) -> dict:
    """The parameters for the source of the right camera."""
    return {**values, 'device': values['right_device'], 'path': values['right_path'] or values['path'], 'topic': values['right_topic']}


def make_dual_source(values: Mapping, clock: Clock, make_topic: Callable[[str], Source]) -> DualSource:
    """The source named by values['source'], not yet open; values: parameters of the dual camera node; make_topic: creates the source for
    one image topic. Raises BadArgument, listing the names, for an unknown one."""
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

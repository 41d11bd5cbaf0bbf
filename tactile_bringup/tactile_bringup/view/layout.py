# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The arrangement of Rerun's views: of one sensor, or of all sensors of a hand, from the topics that they have."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb


@dataclass(frozen=True)
class Lines:
    """Lines of a plot: path of their entity in a namespace, the topic from which it comes, names and colours."""

    path: str
    topic: str
    names: tuple[str, ...]
    colours: tuple[tuple[int, int, int], ...]


_RED, _GREEN, _BLUE, _GOLD = (224, 64, 64), (48, 160, 80), (64, 112, 224), (208, 144, 16)
_PLOTS = {
    'force, N': (Lines('wrench/force', 'wrench', ('x', 'y', 'z'), (_RED, _GREEN, _BLUE)),
                 Lines('force', 'contacts', ('normal, all contacts',), (_GOLD,))),
    'depth, mm': (Lines('depth', 'contacts', ('deepest contact',), (_GOLD,)),),
    'slip': (Lines('slip/fraction', 'slip', ('slipping fraction',), (_BLUE,)),
             Lines('slip/state', 'slip', ('1 incipient, 2 gross',), (_RED,))),
    'latency, ms': (Lines('latency', 'contacts', ('from exposure to here',), (_GREEN,)),),
    'voltages, V': (Lines('voltages', 'voltages', ('x1', 'y1', 'x2', 'y2'), (_RED, _GREEN, _BLUE, _GOLD)),),
}
_SOLID = 'PointCloud2', 'WrenchStamped', 'DotTracks', 'ContactRegion', 'Contacts', 'Slip'
Sensors = Mapping[str, Mapping[str, str]]  # namespace -> topic -> type


def line_styles(sensors: Sensors) -> dict[str, rr.SeriesLines]:
    """Entity -> names and colours of its lines, of all plots of the sensors."""
    return {f'{space}/{each.path}': rr.SeriesLines(names=each.names, colors=each.colours)
            for space, topics in sensors.items() for lines in _PLOTS.values() for each in lines if f'{space}/{each.topic}' in topics}


def blueprint(sensors: Sensors, frame: str) -> rrb.Blueprint:
    """The views for sensors.

    Parameters
    ----------
    sensors : Mapping
        Namespace -> topic -> type.
    frame : str
        Frame in which all is shown: of one sensor its own, of a hand the hand's.
    """
    solids = [f'+ {topic}/**' for topics in sensors.values() for topic, kind in topics.items() if kind.endswith(_SOLID)]
    space = rrb.Spatial3DView(origin='/', contents=[*solids, '+ /tf/**'], name=frame or 'sensors',
                              spatial_information=rrb.SpatialInformation(target_frame=frame))
    images = [_image(topic) for topics in sensors.values() for topic, kind in topics.items() if kind.endswith('Image')]
    upper = rrb.Horizontal(space, rrb.Grid(*images), column_shares=[3, 2]) if images else space
    plots = [view for name, lines in _PLOTS.items() if (view := _plot(name, lines, sensors))]
    log = rrb.TextLogView(origin='/diagnostics', name='diagnostics', columns=rrb.TextLogColumns(
        timeline_columns=[], text_log_columns=['loglevel', 'body']))
    return rrb.Blueprint(rrb.Vertical(upper, rrb.Horizontal(*plots, log), row_shares=[3, 2]), collapse_panels=True)


def _image(topic: str) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=topic, contents='$origin/**', name=topic)


def _plot(name: str, lines: Sequence[Lines], sensors: Sensors) -> rrb.TimeSeriesView | None:
    """A plot of the lines that the sensors have; None for none."""
    paths = [f'+ {space}/{each.path}' for space, topics in sensors.items() for each in lines if f'{space}/{each.topic}' in topics]
    return rrb.TimeSeriesView(origin='/', contents=paths, name=name) if paths else None

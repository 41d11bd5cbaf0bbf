# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Builds RViz configurations. Needs no ROS."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import yaml

from .camera_view import OrbitView
from .window_state import window_state

WINDOW = 1600, 960  # px, chosen
_LEFT, _RIGHT = 260, 600  # px, chosen: widths of the docks of displays and of pictures; pictures of 640 px appear nearly in full size
_FRAME = 44, 100  # px: width of the bars beside the 3D view; height of menu, tools and status
_MOST_ROWS = 3  # rows of pictures, chosen: further pictures go into tabs
_TOPIC = {'History Policy': 'Keep Last', 'Durability Policy': 'Volatile'}


def display(kind: str, name: str, **properties) -> dict:
    """Display of rviz_default_plugins."""
    return {'Class': f'rviz_default_plugins/{kind}', 'Name': name, 'Enabled': True, **properties, 'Value': True}


def markers(name: str, topic: str, namespaces: Sequence[str] = ()) -> dict:
    """MarkerArray display of a topic, with a checkbox for each namespace."""
    properties = {'Namespaces': dict.fromkeys(namespaces, True)} if namespaces else {}
    return display('MarkerArray', name, Topic={'Value': topic, 'Depth': 5, 'Reliability Policy': 'Reliable', **_TOPIC}, **properties)


def image(name: str, topic: str, reliability: str = 'Reliable', normalize: bool = False) -> dict:
    """Image display, which has a panel of its own."""
    topic = {'Value': topic, 'Depth': 1, 'Reliability Policy': reliability, **_TOPIC}
    return display('Image', name, Topic=topic, **{'Normalize Range': normalize})


def cloud(name: str, topic: str, size: float, channel: str, limits: tuple[float, float]) -> dict:
    """Point cloud display, off by default: spheres of size, m, coloured from violet to red by the field channel within limits.

    The limits are fixed because RViz's automatic ones become NaN when any value is NaN.
    """
    shown = display('PointCloud2', name, Topic={'Value': topic, 'Depth': 5, 'Reliability Policy': 'Reliable', **_TOPIC}, Style='Spheres',
                    **{'Size (m)': float(f'{size:.3g}'), 'Position Transformer': 'XYZ', 'Color Transformer': 'Intensity',
                       'Channel Name': channel, 'Use rainbow': True, 'Invert Rainbow': True, 'Autocompute Intensity Bounds': False,
                       'Min Intensity': float(f'{limits[0]:.3g}'), 'Max Intensity': float(f'{limits[1]:.3g}')})
    return {**shown, 'Enabled': False, 'Value': False}


def grid(name: str, width: float) -> dict:
    """Grid display: the plane z = 0 in ten by ten cells, slightly wider than width, m."""
    return display('Grid', name, **{'Cell Size': cell_size(1.2 * width / 10), 'Plane Cell Count': 10, 'Plane': 'XY',
                                    'Color': '110; 110; 120', 'Reference Frame': '<Fixed Frame>'})


def cell_size(least: float) -> float:
    """Smallest of 1, 2 and 5 times a power of ten, m, that is at least least."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(f'{next(step * power for step in (1, 2, 5, 10) if step * power >= least):.6g}')


def frames(width: float, hidden: Sequence[str] = ()) -> dict:
    """TF display with axes about a sixth of width, m, long; hidden: frames not shown because their labels would cover others."""
    # RViz draws axes 0.2 m long at scale 1.
    listed = {'All Enabled': True, **{name: {'Value': False} for name in hidden}}
    return display('TF', 'Frames', **{'Marker Scale': float(f'{0.8 * width:.3g}'), 'Show Arrows': False, 'Show Axes': True,
                                      'Show Names': True, 'Frames': listed})


def room(pictures: int) -> tuple[int, int]:
    """Size (width, height), px, of the 3D view beside the given number of pictures."""
    return WINDOW[0] - _FRAME[0] - _LEFT - (_RIGHT if pictures else 0), WINDOW[1] - _FRAME[1]


def page(displays: Sequence[dict], frame: str, view: OrbitView) -> str:
    """Text of a configuration; pictures stand at the right in the order of their displays."""
    pictures = [entry['Name'] for entry in displays if entry['Class'].endswith('/Image')]
    rows = [pictures[k::_MOST_ROWS] for k in range(min(_MOST_ROWS, len(pictures)))]
    state = window_state((WINDOW[0], WINDOW[1] - _FRAME[1]), ('Displays', _LEFT), rows, _RIGHT, ('Views', 'Time'))
    hidden = {'Views': {'collapsed': True}, 'Time': {'collapsed': True}}
    geometry = {**hidden, 'Displays': {'collapsed': False}, **{name: {'collapsed': False} for name in pictures},
                'Height': WINDOW[1], 'Width': WINDOW[0], 'QMainWindow State': state}
    manager = {'Class': '', 'Displays': list(displays), 'Enabled': True, 'Name': 'root', 'Value': True,
               'Global Options': {'Background Color': '32; 32; 38', 'Fixed Frame': frame, 'Frame Rate': 30},
               'Tools': [{'Class': f'rviz_default_plugins/{name}'} for name in ('MoveCamera', 'Select', 'Measure')],
               'Views': {'Current': _view(view), 'Saved': None}}
    panels = [{'Class': f'rviz_common/{name}', 'Name': name} for name in ('Displays', 'Views', 'Time')]
    return yaml.safe_dump({'Panels': panels, 'Visualization Manager': manager, 'Window Geometry': geometry}, sort_keys=False, width=140)


def _view(view: OrbitView) -> dict:
    return {'Class': 'rviz_default_plugins/Orbit', 'Name': 'Current View', 'Distance': view.distance,
            'Focal Point': dict(zip('XYZ', view.focal_point)), 'Pitch': view.pitch, 'Yaw': view.yaw, 'Near Clip Distance': 0.001,
            'Target Frame': '<Fixed Frame>', 'Value': 'Orbit (rviz_default_plugins)'}

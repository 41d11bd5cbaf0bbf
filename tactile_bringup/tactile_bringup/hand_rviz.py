# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One RViz configuration for all sensors of a hand, each in its place. No ROS here."""
from __future__ import annotations

import numpy as np
import yaml

from .hand_file import Hand, HandSensor

#: sensors that have a picture with what they feel drawn into it
ANNOTATED = ('touchpad', 'areal_single', 'areal_dual', 'air_cushion')
_CELL, _CELLS = 0.01, 40
_TOPIC = {'History Policy': 'Keep Last', 'Durability Policy': 'Volatile'}


def rviz_configuration(hand: Hand) -> str:
    """The file's text: the hand's frame, each sensor's markers, and the annotated pictures of those that have some."""
    displays = [_display('Grid', 'Base', **{'Cell Size': _CELL, 'Plane Cell Count': _CELLS, 'Plane': 'XY', 'Color': '110; 110; 120',
                                            'Reference Frame': '<Fixed Frame>'}),
                _display('TF', 'Frames', **{'Marker Scale': 0.05, 'Show Arrows': False, 'Show Axes': True, 'Show Names': True})]
    displays += [_markers(sensor) for sensor in hand.sensors]
    displays += [_picture(sensor) for sensor in hand.sensors if sensor.type in ANNOTATED]
    places = np.array([sensor.xyz for sensor in hand.sensors])
    manager = {'Class': '', 'Displays': displays, 'Enabled': True, 'Name': 'root', 'Value': True,
               'Global Options': {'Background Color': '32; 32; 38', 'Fixed Frame': hand.frame, 'Frame Rate': 30},
               'Tools': [{'Class': f'rviz_default_plugins/{name}'} for name in ('MoveCamera', 'Select', 'Measure')],
               'Views': {'Current': _view(places), 'Saved': None}}
    page = {'Panels': [{'Class': 'rviz_common/Displays', 'Name': 'Displays'}, {'Class': 'rviz_common/Views', 'Name': 'Views'}],
            'Visualization Manager': manager, 'Window Geometry': {'Height': 1000, 'Width': 1600}}
    return yaml.safe_dump(page, sort_keys=False)


def _display(kind: str, name: str, **properties) -> dict:
    return {'Class': f'rviz_default_plugins/{kind}', 'Name': name, 'Enabled': True, **properties, 'Value': True}


def _markers(sensor: HandSensor) -> dict:
    topic = {'Value': f'/{sensor.name}/markers', 'Depth': 5, 'Reliability Policy': 'Reliable', **_TOPIC}
    return _display('MarkerArray', sensor.name, Topic=topic)


def _picture(sensor: HandSensor) -> dict:
    return _display('Image', f'{sensor.name}: annotated', **{
        'Topic': {'Value': f'/{sensor.name}/image_annotated', 'Depth': 1, 'Reliability Policy': 'Reliable', **_TOPIC},
        'Normalize Range': False})


def _view(places: np.ndarray) -> dict:
    """A view of all sensors: towards their middle, from so far that the furthest is in sight."""
    middle = places.mean(axis=0)
    distance = 0.15 + 2.0 * float(np.linalg.norm(places - middle, axis=1).max())
    return {'Class': 'rviz_default_plugins/Orbit', 'Name': 'Current View', 'Distance': round(distance, 3),
            'Focal Point': dict(zip('XYZ', (round(float(x), 4) for x in middle))), 'Pitch': 0.7, 'Yaw': 0.8, 'Near Clip Distance': 0.001,
            'Target Frame': '<Fixed Frame>', 'Value': 'Orbit (rviz_default_plugins)'}

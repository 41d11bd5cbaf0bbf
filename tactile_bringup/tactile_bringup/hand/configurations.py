# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes configurations for a hand: HAND.rviz for RViz and HAND_diagnostics.yaml for diagnostic_aggregator.

    ros2 run tactile_bringup hand_config HAND.yaml FOLDER
"""
from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation
from tactile_driver.command import tells_errors

from .description import Hand, HandSensor, read_hand
from ..installed import share

_FIELD_OF_VIEW = np.pi / 4  # rad, vertical: Ogre's default, which RViz does not change
_FILLED = 0.9  # share of the picture


def aggregator_configuration(hand: Hand) -> str:
    """Text of the aggregator's parameter file: one analyzer per sensor, which collects the diagnostics of the nodes in its namespace."""
    analyzers = {sensor.frame: {'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': sensor.name, 'startswith': [f'/{sensor.name}/']}
                 for sensor in hand.sensors}
    return yaml.safe_dump({'analyzers': {'ros__parameters': {'path': hand.frame, **analyzers}}}, sort_keys=False)


def moved_file(sensor_type: str, namespace: str, frame: str) -> str:
    """Text of a sensor's RViz configuration for another namespace and sensor frame."""
    text = Path(share('rviz', f'{sensor_type}.rviz')).read_text()
    text = text.replace(f': /{sensor_type}/', f': /{namespace}/'.replace('//', '/'))
    return text.replace(f'Fixed Frame: {sensor_type}\n', f'Fixed Frame: {frame}\n')


def rviz_configuration(hand: Hand) -> str:
    """Text of the RViz file: hand.rviz with the markers and the annotated image of each sensor, and all of them in view."""
    page = yaml.safe_load(Path(share('rviz', 'hand.rviz')).read_text())
    manager, geometry, points = page['Visualization Manager'], page['Window Geometry'], []
    for number, sensor in enumerate(hand.sensors, 1):
        own = yaml.safe_load(moved_file(sensor.type, sensor.name, sensor.frame))['Visualization Manager']
        touch, picture = ({**each, 'Name': title} for title, each in zip(
            (sensor.name, f'{sensor.name}: annotated'), (_display(own, 'Touch'), _display(own, 'Annotated image'))))
        manager['Displays'] += [touch, picture]
        # Qt places a dock by its name; images beyond those that the file has room for float.
        geometry['QMainWindow State'] = geometry['QMainWindow State'].replace(_dock(f'image {number}'), _dock(picture['Name']))
        geometry[picture['Name']] = {'collapsed': False}
        view = own['Views']['Current']
        middle = np.array([view['Focal Point'][axis] for axis in 'XYZ'])
        points.append(_place(hand, sensor)(middle + 0.3 * view['Distance'] * np.vstack([np.eye(3), -np.eye(3)])))
    manager['Global Options']['Fixed Frame'] = hand.frame
    view = manager['Views']['Current']
    view['Distance'], focal = closest_view(np.vstack(points), (696, 860), view['Yaw'], view['Pitch'])
    view['Focal Point'] = dict(zip('XYZ', focal))
    return yaml.safe_dump(page, sort_keys=False, width=140)


def closest_view(points: np.ndarray, size: tuple[int, int], yaw: float, pitch: float) -> tuple[float, list[float]]:
    """Distance and focal point (3,), m, of RViz's Orbit view at yaw and pitch, rad, that shows points (N, 3), m, in a picture of size
    (width, height), px, and fills _FILLED of it at the most."""
    towards = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    axes = np.stack([right, np.cross(towards, right), towards])
    seen = points @ axes.T
    focal = 0.5 * (seen.max(axis=0) + seen.min(axis=0))
    across, up, back = (seen - focal).T
    slopes = _FILLED * np.tan(0.5 * _FIELD_OF_VIEW) * np.array([size[0] / size[1], 1.0])
    # A point is visible where |side| <= slope * (distance - depth).
    distance = max((np.abs(side) / slope + back).max() for side, slope in zip((across, up), slopes))
    return float(distance), (focal @ axes).tolist()


def _display(manager: dict, name: str) -> dict:
    return next(display for display in manager['Displays'] if display['Name'] == name)


def _dock(name: str) -> str:
    """A dock's name as Qt writes it in the state of a window."""
    text = name.encode('utf-16-be')
    return (len(text).to_bytes(4, 'big') + text).hex()


def _place(hand: Hand, sensor: HandSensor) -> Callable[[np.ndarray], np.ndarray]:
    """Function from points (N, 3), m, in the sensor's frame to the hand's frame; an unknown parent counts as the hand's frame."""
    by_frame = {other.frame: other for other in hand.sensors}

    def placed(points: np.ndarray) -> np.ndarray:
        points = Rotation.from_quat(sensor.quaternion).apply(points) + sensor.xyz
        return _place(hand, by_frame[sensor.parent])(points) if sensor.parent in by_frame else points
    return placed


@tells_errors('hand_config', OSError)
def main(args: list[str] | None = None) -> int:
    """Write both files; exit code 1 for a wrong hand file or a folder that cannot be written."""
    parser = argparse.ArgumentParser(prog='hand_config', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('hand', type=Path, help='YAML file with the sensors of the hand')
    parser.add_argument('folder', type=Path, help='where to write')
    given = parser.parse_args(args)
    hand = read_hand(given.hand)
    given.folder.mkdir(parents=True, exist_ok=True)
    for end, text in (('.rviz', rviz_configuration(hand)), ('_diagnostics.yaml', aggregator_configuration(hand))):
        path = given.folder / (given.hand.stem + end)
        path.write_text(text)
        print(path)
    return 0

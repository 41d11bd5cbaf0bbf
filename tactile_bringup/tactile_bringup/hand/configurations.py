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
from tactile_driver.errors import tells_errors
from tactile_perception.sensor_type import SENSOR_TYPES

from .description import Hand, HandSensor, read_hand
from .. import share

_AROUND, _AWAY = 0.1, 2.0  # m of each sensor, and times the hand's size to the viewpoint: RViz's field of view is 45 degrees high. Chosen


def aggregator_configuration(hand: Hand) -> str:
    """Text of the aggregator's parameter file: one analyzer per sensor, which collects the diagnostics of the nodes in its namespace."""
    analyzers = {sensor.frame: {'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': sensor.name, 'startswith': [f'/{sensor.name}/']}
                 for sensor in hand.sensors}
    return yaml.safe_dump({'analyzers': {'ros__parameters': {'path': hand.frame, **analyzers}}}, sort_keys=False)


def moved_file(sensor_type: str, namespace: str, frame: str) -> str:
    """Text of a sensor's RViz configuration for another namespace and sensor frame."""
    text = Path(share('rviz', f'{sensor_type}.rviz', package=SENSOR_TYPES[sensor_type].package)).read_text()
    text = text.replace(f': /{sensor_type}/', f': /{namespace}/'.replace('//', '/'))
    return text.replace(f'Fixed Frame: {sensor_type}\n', f'Fixed Frame: {frame}\n')


def rviz_configuration(hand: Hand) -> str:
    """Text of the RViz file: hand.rviz with the markers and the annotated image of each sensor, and all of them in view."""
    page = yaml.safe_load(Path(share('rviz', 'hand.rviz')).read_text())
    manager = page['Visualization Manager']
    for sensor in hand.sensors:
        own = yaml.safe_load(moved_file(sensor.type, sensor.name, sensor.frame))['Visualization Manager']
        touch, picture = ({**each, 'Name': title} for title, each in zip(
            (sensor.name, f'{sensor.name}: annotated'), (_display(own, 'Touch'), _display(own, 'Annotated image'))))
        manager['Displays'] += [touch, picture]
    manager['Global Options']['Fixed Frame'] = hand.frame
    view = manager['Views']['Current']
    places = np.vstack([_place(hand, sensor)(np.zeros((1, 3))) for sensor in hand.sensors])
    view['Distance'] = float(_AWAY * (np.linalg.norm(np.ptp(places, axis=0)) + _AROUND))
    view['Focal Point'] = dict(zip('XYZ', (0.5 * (places.max(axis=0) + places.min(axis=0))).tolist()))
    return yaml.safe_dump(page, sort_keys=False, width=140)


def _display(manager: dict, name: str) -> dict:
    return next(display for display in manager['Displays'] if display['Name'] == name)


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

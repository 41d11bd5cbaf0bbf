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
from ..sensor_types import SENSOR_TYPES
from ..visualization.rviz import page
from ..visualization.rviz.camera_view import view_of
from ..visualization.rviz.sensor_shape import SensorShape, shape_of


def aggregator_configuration(hand: Hand) -> str:
    """Text of the aggregator's parameter file: one analyzer per sensor, which collects the diagnostics of the nodes in its namespace."""
    analyzers = {sensor.frame: {'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': sensor.name, 'startswith': [f'/{sensor.name}/']}
                 for sensor in hand.sensors}
    return yaml.safe_dump({'analyzers': {'ros__parameters': {'path': hand.frame, **analyzers}}}, sort_keys=False)


def rviz_configuration(hand: Hand) -> str:
    """Text of the RViz file: the hand's frame, and the markers and the annotated image of each sensor."""
    shapes = [_shape(sensor) for sensor in hand.sensors]
    points = np.vstack([_place(hand, sensor)(shape.outermost()) for sensor, shape in zip(hand.sensors, shapes)])
    pictures = [page.image(f'{sensor.name}: annotated', f'/{sensor.name}/image_annotated') for sensor in hand.sensors]
    hidden = [f'{sensor.frame}_{SENSOR_TYPES[sensor.type].own_frame}' for sensor in hand.sensors]
    displays = [page.grid('Base', float(np.ptp(points[:, :2], axis=0).max())),
                page.frames(float(np.median([shape.width for shape in shapes])), hidden),
                *(page.markers(sensor.name, f'/{sensor.name}/markers') for sensor in hand.sensors), *pictures]
    return page.page(displays, hand.frame, view_of(points, page.room(len(pictures))))


def _shape(sensor: HandSensor) -> SensorShape:
    own = sensor.settings.get('params') or share('params', f'{sensor.type}.yaml')
    return shape_of(Path(own).read_text())


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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One RViz configuration for all sensors of a hand, each in its place. No ROS here."""
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .hand_file import Hand, HandSensor
from .sensor_launch import share
from .sensor_types import SENSOR_TYPES
from .visualization import rviz_page
from .visualization.camera_view import view_of
from .visualization.sensor_shape import SensorShape, shape_of

#: sensor type -> what the frames are called that it has besides, and that would only crowd the view
_BESIDES = {'psd_finger': 'tip', 'taxel_array': 'taxels'}


def rviz_configuration(hand: Hand) -> str:
    """The file's text: the hand's frame, each sensor's markers, and the annotated pictures of those that have some."""
    shapes = [_shape(sensor) for sensor in hand.sensors]
    points = np.vstack([_place(hand, sensor)(shape.outermost()) for sensor, shape in zip(hand.sensors, shapes)])
    pictures = [rviz_page.image(f'{sensor.name}: annotated', f'/{sensor.name}/image_annotated') for sensor in hand.sensors
                if SENSOR_TYPES[sensor.type].annotated]
    hidden = [f'{sensor.frame}_{_BESIDES.get(sensor.type, "camera")}' for sensor in hand.sensors]
    displays = [rviz_page.grid('Base', float(np.ptp(points[:, :2], axis=0).max())),
                rviz_page.frames(float(np.median([shape.width for shape in shapes])), hidden),
                *(rviz_page.markers(sensor.name, f'/{sensor.name}/markers') for sensor in hand.sensors), *pictures]
    return rviz_page.page(displays, hand.frame, view_of(points, rviz_page.room(len(pictures))))


def _shape(sensor: HandSensor) -> SensorShape:
    own = sensor.settings.get('params') or share('params', f'{sensor.type}.yaml')
    return shape_of(Path(own).read_text())


def _place(hand: Hand, sensor: HandSensor) -> Callable[[np.ndarray], np.ndarray]:
    """From points (N, 3), m, in the sensor's frame to the hand's; a parent that is no sensor of the hand stands at the hand's frame."""
    by_frame = {other.frame: other for other in hand.sensors}

    def placed(points: np.ndarray) -> np.ndarray:
        points = Rotation.from_quat(sensor.quaternion).apply(points) + sensor.xyz
        return _place(hand, by_frame[sensor.parent])(points) if sensor.parent in by_frame else points
    return placed

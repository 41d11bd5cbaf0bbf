# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes configurations for a hand: HAND.rviz for RViz, HAND_diagnostics.yaml for diagnostic_aggregator, and of a YAML file also
HAND.urdf.xacro, the same hand as a URDF.

    ros2 run tactile_bringup hand_config HAND.yaml FOLDER
"""
from __future__ import annotations

import argparse
import struct
from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from tactile_driver.errors import reports_errors

from .. import share
from ..sensor_files import rviz_file
from .constants import HAND
from .description import Hand, HandSensor, read_hand
from .urdf import Pose, mounting


def aggregator_configuration(hand: Hand) -> str:
    """Text of the aggregator's parameter file: one analyzer per sensor, which collects the diagnostics of the nodes in its namespace."""
    analyzers = {sensor.frame: {'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': sensor.name, 'startswith': [f'/{sensor.name}/']}
                 for sensor in hand.sensors}
    return yaml.safe_dump({'analyzers': {'ros__parameters': {'path': hand.frame, **analyzers}}}, sort_keys=False)


def xacro_description(hand: Hand) -> str:
    """Text of a xacro file with the sensors of a hand. A parent that is not a sensor becomes a link without a shape."""
    frames = {sensor.frame for sensor in hand.sensors}
    parents = dict.fromkeys(sensor.parent for sensor in hand.sensors if sensor.parent not in {*frames, hand.frame})
    robot = Element('robot', {'name': hand.frame.replace('/', '_'), 'xmlns:xacro': 'http://www.ros.org/wiki/xacro'})
    SubElement(robot, 'xacro:include', filename='$(find tactile_bringup)/urdf/tactile_sensors.xacro')
    SubElement(robot, 'link', name=hand.frame)
    for parent in parents:
        SubElement(robot, 'link', name=parent)
        joint = SubElement(robot, 'joint', name=f'{parent}_to_be_placed', type='fixed')
        SubElement(joint, 'parent', link=hand.frame)
        SubElement(joint, 'child', link=parent)
    macros = Path(share('urdf', 'tactile_sensors.xacro')).read_text()
    for sensor in hand.sensors:
        has_macro = f'name="{sensor.type}"' in macros and sensor.type != 'pins'  # whose size has no default
        added = SubElement(robot, f'xacro:{sensor.type}' if has_macro else 'xacro:tactile_sensor',
                           {'name': sensor.name, 'parent': sensor.parent, **({} if has_macro else {'type': sensor.type})})
        rpy = Rotation.from_quat(sensor.quaternion).as_euler('xyz')
        SubElement(added, 'origin', xyz=_joined(sensor.xyz), rpy=_joined(rpy))
        SubElement(added, 'settings', sensor.settings)
        if not has_macro:
            SubElement(added, 'shape')
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding='unicode') + '\n'


def _joined(values: Sequence[float]) -> str:
    return ' '.join(f'{value:.9g}' for value in values)


def moved_file(sensor_type: str, namespace: str, frame: str) -> str:
    """Text of a sensor's RViz configuration for another namespace and sensor frame."""
    file, drawn = rviz_file(sensor_type)
    text = Path(file).read_text()
    text = text.replace(f': /{drawn}/', f': /{namespace}/'.replace('//', '/'))
    return text.replace(f'Fixed Frame: {drawn}\n', f'Fixed Frame: {frame}\n')


def rviz_configuration(hand: Hand) -> str:
    """Text of the RViz file: hand.rviz with the markers and the annotated image of each sensor, and all of them in view."""
    page = yaml.safe_load(Path(share('rviz', 'hand.rviz')).read_text())
    manager = page['Visualization Manager']
    for sensor in hand.sensors:
        own = yaml.safe_load(moved_file(sensor.type, sensor.name, sensor.frame))['Visualization Manager']
        touch, picture = ({**each, 'Name': title} for title, each in zip(
            (sensor.name, f'{sensor.name}: annotated'), (_display(own, 'Touch'), _display(own, 'Annotated image'))))
        manager['Displays'] += [touch, picture]
    if hand.robot is not None:
        manager['Displays'].append({'Class': 'rviz_default_plugins/RobotModel', 'Name': 'Hand', 'Enabled': True, 'Value': True,
                                    'Description Topic': {'Value': '/robot_description', 'Durability Policy': 'Transient Local'}})
    pictures = [display['Name'] for display in manager['Displays'] if display['Class'].endswith('/Image')]
    page['Window Geometry'] = {'Height': HAND.window_height, 'Width': HAND.window_width, 'QMainWindow State': _window_state(pictures)}
    manager['Global Options']['Fixed Frame'] = hand.frame
    view = manager['Views']['Current']
    origins = _origins(hand)
    view['Distance'] = _distance(origins)
    middle = 0.5 * (origins.max(axis=0) + origins.min(axis=0))
    # The viewpoint is at positive x. This shift puts the first and the last sensor at equal distances from the middle of the picture.
    middle[0] += np.ptp(origins[:, 0]) ** 2 * np.cos(view['Pitch']) / (4 * view['Distance'])
    view['Focal Point'] = dict(zip('XYZ', middle.tolist()))
    return yaml.safe_dump(page, sort_keys=False, width=140)


def _window_state(pictures: Sequence[str]) -> str:
    """The layout of RViz's window, hexadecimal, as QMainWindow::saveState of Qt 5 writes it: Displays at the left, pictures at the right,
    one above the other, because RViz 14 closes a picture that is hidden behind a tab."""
    def area(side: int, width: int, names: Sequence[str]) -> bytes:
        """A column of docks at a side of the window (0: left, 1: right), width px wide."""
        found = struct.pack('>IIIBBI', side, width, HAND.dock_height, 0xfc, 2, len(names))  # 2: a column
        for number, name in enumerate(names):
            height, title = HAND.dock_height // len(names), name.encode('utf-16-be')
            found += struct.pack('>BI', 0xfb, len(title)) + title
            found += struct.pack('>B4I', 1, number * height, height, 60, 0xffffff)  # visible, top, height, its limits
        return found

    areas = area(0, HAND.displays_width, ['Displays']) + area(1, HAND.pictures_width, pictures)
    # Two areas; then the size of the 3D view, which area has each corner, no tool bars.
    return (struct.pack('>IIBI', 0xff, 0, 0xfd, 2) + areas + struct.pack(
        '>6IBI', HAND.window_width - HAND.displays_width - HAND.pictures_width, HAND.dock_height, 4, 4, 8, 8, 0xfc, 0)).hex()


def text_parameters(hand: Hand, sensor: HandSensor) -> dict[str, object]:
    """Parameters of the node that draws a sensor of a hand: letters that are legible in the view of the hand, on the outer side."""
    origins, rotation = _origins(hand), _pose(hand, sensor)[0]
    outwards = (_pose(hand, sensor)[1] - origins.mean(axis=0)) * [1.0, 1.0, 0.0]
    length = float(np.linalg.norm(outwards))
    side = outwards / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])  # m; a sensor alone, or one in the middle
    side[2] = HAND.text_rise * max(0.0, -side[0])  # the viewpoint is at positive x
    return {'text.height': HAND.letter_height * _distance(origins), 'text.side': rotation.inv().apply(side).round(9).tolist(),
            'text.up': rotation.inv().apply([0.0, 0.0, 1.0]).round(9).tolist()}


def _origins(hand: Hand) -> np.ndarray:
    """(N, 3), m, of the sensors' frames in the hand's frame."""
    return np.stack([_pose(hand, sensor)[1] for sensor in hand.sensors])


def _distance(origins: np.ndarray) -> float:
    """Distance in m from the viewpoint to the middle of sensors at (N, 3), m."""
    return float(HAND.view_distance * (np.linalg.norm(np.ptp(origins, axis=0)) + HAND.sensor_size))


def _display(manager: dict, name: str) -> dict:
    return next(display for display in manager['Displays'] if display['Name'] == name)


def _pose(hand: Hand, sensor: HandSensor) -> Pose:
    """Rotation and origin (3,), m, of a sensor's frame in the hand's frame, with all joints at 0. An unknown parent is replaced by the
    hand's frame."""
    at_zero = dict.fromkeys(hand.robot.positioned, 0.0) if hand.robot else {}
    return hand.pose(sensor, at_zero) or mounting(sensor.xyz, sensor.quaternion)


@reports_errors('hand_config', OSError)
def main(args: list[str] | None = None) -> int:
    """Write both files; exit code 1 for a wrong hand file or a folder that cannot be written."""
    parser = argparse.ArgumentParser(prog='hand_config', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('hand', type=Path, help='YAML, URDF or xacro file with the sensors of the hand')
    parser.add_argument('folder', type=Path, help='folder for the files')
    given = parser.parse_args(args)
    hand = read_hand(given.hand)
    given.folder.mkdir(parents=True, exist_ok=True)
    texts = {'.rviz': rviz_configuration(hand), '_diagnostics.yaml': aggregator_configuration(hand)}
    if hand.robot is None:
        texts['.urdf.xacro'] = xacro_description(hand)
    for end, text in texts.items():
        path = given.folder / (given.hand.name.split('.')[0] + end)
        path.write_text(text)
        print(path)
    return 0

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the sensors of a hand and their mounting poses, from a YAML file or from the hand's URDF. Needs no ROS."""
from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from tactile_driver.errors import BadArgument
from tactile_perception.core.sensor_type import SENSOR_TYPES

from .constants import HAND

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from .urdf import Pose, Robot

#: Launch arguments of a sensor with the same names; the first two are paths.
_SETTINGS = ('calibration', 'params', 'device', 'right_device', 'rate', 'scene')
_PATHS = _SETTINGS[:2]
_KEYS = ('name', 'type', 'parent', 'xyz', 'rpy', 'quaternion', *_SETTINGS)
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*')
_DESCRIPTIONS = ('.urdf', '.xacro', '.xml')


@dataclass(frozen=True)
class HandSensor:
    """One sensor.

    name: also its namespace; parent: parent frame; xyz (m), quaternion (x, y, z, w): pose of the sensor frame in the parent frame;
    settings: arguments of the sensor's launch file, as text.
    """

    name: str
    type: str
    parent: str
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    settings: dict[str, str] = field(default_factory=dict)

    @property
    def frame(self) -> str:
        """Name of the sensor frame."""
        return self.name.replace('/', '_')


@dataclass(frozen=True)
class Hand:
    """The sensors of a hand.

    Attributes
    ----------
    frame : str
        Root frame, parent of all sensors, directly or through others.
    sensors : tuple of HandSensor
        In the order of the file. Those of a URDF have the pose in `frame` that they have while all joints are at position 0.
    robot : Robot or None
        Links and joints of the URDF; None for a hand of a YAML file.
    """

    frame: str
    sensors: tuple[HandSensor, ...]
    robot: Robot | None = None

    def pose(self, sensor: HandSensor, positions: Mapping[str, float]) -> Pose | None:
        """Rotation and origin (3,), m, of a sensor's frame in the hand's; None where a joint or the parent frame is unknown.

        positions: joint -> rad or m.
        """
        from .urdf import chained, mounting
        if self.robot is not None:
            needed = (joint.source for joint in self.robot.chain(sensor.frame) if joint.is_movable)
            return self.robot.pose(sensor.frame, positions) if all(name in positions for name in needed) else None
        by_frame = {other.frame: other for other in self.sensors}
        own = mounting(sensor.xyz, sensor.quaternion)
        if sensor.parent not in by_frame:
            return own if sensor.parent == self.frame else None
        parent = self.pose(by_frame[sensor.parent], positions)
        return None if parent is None else chained(parent, own)


def read_hand(path: str | Path) -> Hand:
    """Read a hand from a YAML file, a URDF (.urdf, .xml) or a xacro file.

    Raises
    ------
    BadArgument
        With one line that names the fault and its position in the file.
    """
    path = Path(path).expanduser()
    return _read_description(path) if path.suffix in _DESCRIPTIONS else _read_yaml(path)


def _read_yaml(path: Path) -> Hand:
    where = ''
    try:
        page = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BadArgument(f'hand {path}: cannot be read: {" ".join(str(error).split())}') from error
    try:
        _check_keys(page, ('frame', 'sensors'), 'the file')
        frame, listed, sensors = _name(page.get('frame', 'hand'), 'frame'), page.get('sensors'), []
        if not isinstance(listed, list) or not listed:
            raise BadArgument('sensors must be a list of one sensor or more')
        for number, entry in enumerate(listed, 1):
            where = f'sensor {entry["name"]}: ' if isinstance(entry, dict) and 'name' in entry else f'sensor number {number}: '
            sensors.append(_sensor(entry, frame, path.parent))
        where = ''
        _check_frames(sensors, frame)
    except BadArgument as error:
        raise BadArgument(f'hand {path}: {where}{error}') from error
    return Hand(frame, tuple(sensors))


def _read_description(path: Path) -> Hand:
    from .urdf import read_robot, read_xml  # SciPy takes a second to import, and hands of a YAML file do not need it
    where = ''
    try:
        robot, elements = read_robot(read_xml(path))
        if not elements:
            raise BadArgument('holds no tactile_sensor; tactile_sensors.xacro of tactile_bringup has a macro for each type')
        at_zero = dict.fromkeys(robot.positioned, 0.0)
        sensors = []
        for element in elements:
            where = f'sensor {element.get("name", "without a name")}: '
            sensors.append(_described_sensor(element, robot, at_zero, path.parent))
        where = ''
        _check_frames(sensors, robot.root)
    except BadArgument as error:
        raise BadArgument(f'hand {path}: {where}{error}') from error
    return Hand(robot.root, tuple(sensors), robot)


def _described_sensor(element: Element, robot: Robot, at_zero: Mapping[str, float], folder: Path) -> HandSensor:
    """The sensor of a tactile_sensor element. Raises BadArgument."""
    settings = {key: value for child in element.findall('settings') for key, value in child.items() if value}
    entry = {'name': element.get('name'), 'type': element.get('type'), **settings}
    for key in settings:
        if key not in _SETTINGS:
            raise BadArgument(f'setting {key!r} is unknown; known are {", ".join(_SETTINGS)}')
    link = element.get('link', '')
    if link != robot.root and link not in robot.joints:
        raise BadArgument(f'there is no link {link}; the links are {", ".join([robot.root, *robot.joints])}')
    sensor = _sensor(entry, robot.root, folder)
    if link != sensor.frame:
        raise BadArgument(f'its link is {link}, but must have the name of the sensor frame, {sensor.frame}')
    rotation, origin = robot.pose(link, at_zero)
    return replace(sensor, xyz=tuple(origin.tolist()), quaternion=tuple(rotation.as_quat().tolist()))


def _sensor(entry: object, hand_frame: str, folder: Path) -> HandSensor:
    _check_keys(entry, _KEYS, 'a sensor')
    for key in ('name', 'type'):
        if key not in entry:
            raise BadArgument(f'{key} is missing')
    name = _name(entry['name'], 'name')
    if entry['type'] not in SENSOR_TYPES:
        raise BadArgument(f'type {entry["type"]!r} is unknown; choose one of {", ".join(SENSOR_TYPES)}')
    if 'right_device' in entry and 'right_device' not in SENSOR_TYPES[entry['type']].arguments:
        raise BadArgument(f'right_device: a sensor of type {entry["type"]} has one camera at most')
    return HandSensor(name, entry['type'], _name(entry.get('parent', hand_frame), 'parent'), _numbers(entry, 'xyz', 3), _quaternion(entry),
                      _settings(entry, folder))


def _settings(entry: Mapping, folder: Path) -> dict[str, str]:
    """Launch arguments as text; relative paths start at the folder of the hand file."""
    given = {key: entry[key] for key in _SETTINGS if entry.get(key) is not None}
    for key, value in given.items():
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise BadArgument(f'{key} is {value!r}, but must be text or a number')
    return {key: str(folder / Path(str(value)).expanduser()) if key in _PATHS else str(value) for key, value in given.items()}


def _check_keys(entry: object, known: tuple[str, ...], what: str) -> None:
    if not isinstance(entry, dict):
        raise BadArgument(f'{what} must have the form key: value, with the keys {", ".join(known)}')
    for key in entry:
        if key not in known:
            raise BadArgument(f'key {key!r} is unknown; known are {", ".join(known)}')


def _name(value: object, key: str) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise BadArgument(f'{key} is {value!r}, but must be of letters, digits and _, as thumb or left/pad')
    return value


def _numbers(entry: Mapping, key: str, count: int) -> tuple[float, ...]:
    """The count finite numbers of a key; zeros for a missing key. Raises BadArgument."""
    values = entry.get(key, [0.0] * count)
    good = isinstance(values, list) and len(values) == count and all(
        isinstance(v, (int, float)) and not isinstance(v, bool) and math.isfinite(v) for v in values)
    if not good:
        raise BadArgument(f'{key} is {values!r}, but must be a list of {count} numbers')
    return tuple(float(v) for v in values)


def _quaternion(entry: Mapping) -> tuple[float, ...]:
    """Unit quaternion (x, y, z, w) from the key quaternion or from rpy, rad: rotations about the parent's fixed x, y, z axes."""
    if 'quaternion' not in entry:
        from scipy.spatial.transform import Rotation  # takes a second to import, and few hands need it
        return tuple(Rotation.from_euler('xyz', _numbers(entry, 'rpy', 3)).as_quat().tolist())
    if 'rpy' in entry:
        raise BadArgument('rpy and quaternion are both given; give one')
    values = _numbers(entry, 'quaternion', 4)
    length = math.hypot(*values)
    if abs(length - 1.0) > HAND.max_length_error:
        raise BadArgument(f'quaternion is {list(values)!r} of length {length:.3g}, but must have length 1 (x, y, z, w)')
    return tuple(v / length for v in values)


def _check_frames(sensors: list[HandSensor], hand_frame: str) -> None:
    """Raise BadArgument for a frame name used twice and for a cycle of parents."""
    parents: dict[str, str] = {}
    for sensor in sensors:
        if sensor.frame in parents or sensor.frame == hand_frame:
            raise BadArgument(f'sensor {sensor.name}: its name is taken; each needs a name of its own, the hand ({hand_frame}) too')
        parents[sensor.frame] = sensor.parent
    for sensor in sensors:
        frame = sensor.frame
        for _ in sensors:  # a path to the root has no more steps
            frame = parents.get(frame, hand_frame)
        if frame in parents:
            raise BadArgument(f'sensor {sensor.name}: its parent frame {sensor.parent} is mounted on the sensor itself')

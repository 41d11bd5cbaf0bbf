# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the YAML file that lists the sensors of a hand and their mounting poses. Needs no ROS."""
from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from tactile_driver.errors import BadArgument
from tactile_perception.sensor_type import SENSOR_TYPES

#: Launch arguments of a sensor with the same names; the first two are paths.
_SETTINGS = ('calibration', 'params', 'device', 'right_device', 'rate', 'scene')
_PATHS = _SETTINGS[:2]
_KEYS = ('name', 'type', 'parent', 'xyz', 'rpy', 'quaternion', *_SETTINGS)
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*')
_UNIT = 1e-3  # chosen: largest deviation of a quaternion's length from 1


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
    """frame: root frame, parent of all sensors, directly or through another sensor; sensors: in the order of the file."""

    frame: str
    sensors: tuple[HandSensor, ...]


def read_hand(path: str | Path) -> Hand:
    """Read a hand file. Raises BadArgument with one line that names the fault and its place."""
    path, where = Path(path).expanduser(), ''
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
    if abs(length - 1.0) > _UNIT:
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
        for _ in sensors:  # a way to the root has no more steps
            frame = parents.get(frame, hand_frame)
        if frame in parents:
            raise BadArgument(f'sensor {sensor.name}: parent {sensor.parent} hangs on the sensor itself')

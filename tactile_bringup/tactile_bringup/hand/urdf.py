# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads a hand from its URDF or xacro file: links, joints, and the sensors that the macros of tactile_sensors.xacro add."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import xacro
from scipy.spatial.transform import Rotation

from tactile_driver.errors import BadArgument

Pose = tuple[Rotation, np.ndarray]  # of a frame in another one: rotation, and origin (3,), m

_MOVABLE = ('revolute', 'continuous', 'prismatic')
_IDENTITY: Pose = Rotation.identity(), np.zeros(3)


@dataclass(frozen=True)
class Joint:
    """A joint of a robot.

    Attributes
    ----------
    name, kind, parent, child : str
        As in the URDF; `kind` is fixed, revolute, continuous or prismatic.
    mounting : Pose
        Pose of the child link in the parent link at joint position 0.
    axis : ndarray, shape (3,)
        Unit vector in the child link's frame.
    limits : (float, float)
        Smallest and largest position, rad or m.
    source, multiplier, offset : str, float, float
        The joint's position is `multiplier` times the position of the joint `source` plus `offset`; for a joint that mimics no other, its
        own position.
    """

    name: str
    kind: str
    parent: str
    child: str
    mounting: Pose
    axis: np.ndarray
    limits: tuple[float, float]
    source: str
    multiplier: float = 1.0
    offset: float = 0.0

    @property
    def is_movable(self) -> bool:
        """Whether the joint has a position."""
        return self.kind in _MOVABLE

    def pose(self, positions: Mapping[str, float]) -> Pose:
        """Pose of the child link in the parent link; positions: joint -> rad or m, of `source` where the joint is movable."""
        if not self.is_movable:
            return self.mounting
        position = self.multiplier * positions[self.source] + self.offset
        motion = (Rotation.identity(), position * self.axis) if self.kind == 'prismatic' else \
            (Rotation.from_rotvec(position * self.axis), np.zeros(3))
        return chained(self.mounting, motion)


@dataclass(frozen=True)
class Robot:
    """The links and joints of a URDF.

    text: the URDF, without xacro; root: the link without a parent; joints: by the link that each moves.
    """

    text: str
    root: str
    joints: Mapping[str, Joint]

    @cached_property
    def positioned(self) -> tuple[str, ...]:
        """The joints whose positions determine all links, in the order of the URDF."""
        return tuple(dict.fromkeys(joint.source for joint in self.joints.values() if joint.is_movable))

    @cached_property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest position of each joint of `positioned`, rad or m."""
        by_name = {joint.name: joint for joint in self.joints.values()}
        return {name: by_name[name].limits for name in self.positioned}

    def chain(self, link: str) -> list[Joint]:
        """The joints from the root to a link."""
        joints: list[Joint] = []
        while link != self.root:
            joints.insert(0, self.joints[link])
            link = joints[0].parent
        return joints

    def pose(self, link: str, positions: Mapping[str, float]) -> Pose:
        """Pose of a link in the root link; positions: joint -> rad or m."""
        pose = _IDENTITY
        for joint in self.chain(link):
            pose = chained(pose, joint.pose(positions))
        return pose


def mounting(xyz: Sequence[float], quaternion: Sequence[float]) -> Pose:
    """The pose of an origin (3,), m, and a quaternion x, y, z, w."""
    return Rotation.from_quat(quaternion), np.array(xyz, float)


def chained(outer: Pose, inner: Pose) -> Pose:
    """The pose of a frame in A, from the pose of B in A (outer) and of the frame in B (inner)."""
    return outer[0] * inner[0], outer[1] + outer[0].apply(inner[1])


def inverted(pose: Pose) -> Pose:
    """The pose of A in B, from the pose of B in A."""
    turned = pose[0].inv()
    return turned, -turned.apply(pose[1])


def read_xml(path: Path) -> str:
    """The URDF text of a file; a file that ends in .xacro is expanded by xacro. Raises BadArgument."""
    try:
        if path.suffix != '.xacro':
            return path.read_text()
        if not path.is_file():
            raise BadArgument('there is no such file')
        try:
            return xacro.process_file(str(path)).toxml()
        except Exception as error:  # xacro raises exceptions of its own, of the XML parser and of the expressions in the file
            raise BadArgument(f'xacro cannot expand it: {" ".join(str(error).split())}') from error
    except (OSError, UnicodeDecodeError) as error:
        raise BadArgument(f'cannot be read: {" ".join(str(error).split())}') from error


def read_robot(text: str) -> tuple[Robot, list[ElementTree.Element]]:
    """The robot of a URDF, and its `tactile_sensor` elements. Raises BadArgument for links and joints that form no tree."""
    try:
        page = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise BadArgument(f'is not valid XML: {error}') from error
    if page.tag != 'robot':
        raise BadArgument(f'the outermost element is {page.tag}, but must be robot')
    sensors = page.findall('tactile_sensor')
    names = [sensor.get('name') for sensor in sensors]
    taken = next((name for name in names if names.count(name) > 1), None)
    if taken is not None:  # before the links, which its macro makes twice, too
        raise BadArgument(f'sensor {taken}: its name is taken; each needs a name of its own')
    links = [_attribute(link, 'name', 'a link') for link in page.findall('link')]
    joints: dict[str, Joint] = {}
    for element in page.findall('joint'):
        joint = _joint(element)
        for end in (joint.parent, joint.child):
            if end not in links:
                raise BadArgument(f'joint {joint.name}: there is no link {end}; the links are {", ".join(links)}')
        if joint.child in joints:
            raise BadArgument(f'link {joint.child} is the child of two joints, {joints[joint.child].name} and {joint.name}')
        joints[joint.child] = joint
    names = [joint.name for joint in joints.values()]
    for joint in joints.values():
        if joint.is_movable and joint.source not in names:
            raise BadArgument(f'joint {joint.name}: there is no joint {joint.source} that it could mimic')
    roots = [link for link in links if link not in joints]
    if len(roots) != 1:
        raise BadArgument(f'one link must have no parent, but {", ".join(roots) or "none"} has none')
    for link in links:
        _check_reached(link, joints)
    return Robot(text, roots[0], joints), sensors


def _check_reached(link: str, joints: Mapping[str, Joint]) -> None:
    """Raise BadArgument for a link that joints connect in a circle."""
    start = link
    for _ in joints:
        if link not in joints:
            return
        link = joints[link].parent
    if link in joints:
        raise BadArgument(f'the joints above link {start} form a circle')


def _joint(element: ElementTree.Element) -> Joint:
    name = _attribute(element, 'name', 'a joint')
    where = f'joint {name}'
    kind = _attribute(element, 'type', where)
    if kind not in ('fixed', *_MOVABLE):
        raise BadArgument(f'{where}: the type is {kind}; known are fixed, {", ".join(_MOVABLE)}')
    origin, axis, limit, mimic = (element.find(tag) for tag in ('origin', 'axis', 'limit', 'mimic'))
    direction = np.array(_numbers(axis, 'xyz', '1 0 0', 3, where))
    length = np.linalg.norm(direction)
    if not length > 0:
        raise BadArgument(f'{where}: its axis has length 0')
    xyz, rpy = (_numbers(origin, key, '0 0 0', 3, where) for key in ('xyz', 'rpy'))
    lower, upper = (_numbers(limit, key, '0', 1, where)[0] for key in ('lower', 'upper'))
    return Joint(
        name, kind, *(_attribute(element.find(end), 'link', where) for end in ('parent', 'child')),
        (Rotation.from_euler('xyz', rpy), np.array(xyz)), direction / length,
        (-np.pi, np.pi) if kind == 'continuous' else (lower, upper),
        name if mimic is None else _attribute(mimic, 'joint', where),
        _numbers(mimic, 'multiplier', '1', 1, where)[0], _numbers(mimic, 'offset', '0', 1, where)[0])


def _attribute(element: ElementTree.Element | None, key: str, where: str) -> str:
    value = None if element is None else element.get(key)
    if not value:
        raise BadArgument(f'{where}: {key} is missing')
    return value


def _numbers(element: ElementTree.Element | None, key: str, default: str, count: int, where: str) -> list[float]:
    """The finite numbers of an attribute. Raises BadArgument."""
    text = default if element is None else element.get(key, default)
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not np.isfinite(values).all():
        raise BadArgument(f'{where}: {key} is {text!r}, but must be of {count} numbers')
    return values

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where the probe is in the sensor frame, and what the force sensor beside it measures, at the time of an image."""
from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import WrenchStamped
from tf2_msgs.msg import TFMessage

from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_perception.common.geometry import FrameTree, Pose, quaternion, rotation_matrix, wrench_at
from tactile_perception.core.errors import BadFrame


class _Reading(NamedTuple):
    """A wrench: its time, its value (6,), N and N m, since when it has this value, and its frame."""

    stamp_s: float
    value: np.ndarray
    changed_s: float
    frame: str


class Probe:
    """Follows /tf and the force sensor.

    sensor_frame, base: frames of the sensor and of what it is mounted on; mounting: (6,) m and rotation vector, rad, of the sensor frame in
    `base`, or empty where it comes from /tf; report: takes the name and the text of an error.
    """

    def __init__(self, sensor_frame: str, base: str, report: Callable[[str, str], None]):
        self.sensor_frame, self._base, self._report = sensor_frame, base, report
        self.mounting = np.zeros(0)
        self._frames, self._wrenches = FrameTree(), deque[_Reading]()

    def mount(self, mounting: np.ndarray) -> None:
        """Set the pose of the sensor in the frame `base`, if it is given. Raises BadArgument for a wrong number of numbers."""
        if len(mounting) not in (0, 6):
            raise BadArgument(f'calibrate_node: mounting has {len(mounting)} numbers; give x y z, m, and a rotation vector, rad')
        self.mounting = mounting
        if len(mounting):
            self._frames.take(self._base, self.sensor_frame, quaternion(rotation_matrix(mounting[3:])), mounting[:3])

    def take_transforms(self, message: TFMessage, static: bool) -> None:
        """Take a message of /tf or /tf_static; a given mounting holds."""
        for each in message.transforms:
            p, q = each.transform.translation, each.transform.rotation
            if len(self.mounting) and each.child_frame_id.lstrip('/') == self.sensor_frame:
                continue
            try:
                self._frames.take(each.header.frame_id.lstrip('/'), each.child_frame_id.lstrip('/'), np.array([q.x, q.y, q.z, q.w]),
                                  np.array([p.x, p.y, p.z]), *(() if static else (stamp_ns_of(each.header) * 1e-9,)))
            except BadFrame as error:
                self._report('/tf', str(error))

    def take_wrench(self, message: WrenchStamped) -> None:
        """Take a message of the force sensor; the last five seconds are kept."""
        f, t = message.wrench.force, message.wrench.torque
        stamp, value = stamp_ns_of(message.header) * 1e-9, np.array([f.x, f.y, f.z, t.x, t.y, t.z])
        is_same = self._wrenches and (self._wrenches[-1].value == value).all()
        changed_s = self._wrenches[-1].changed_s if is_same else stamp
        self._wrenches.append(_Reading(stamp, value, changed_s, message.header.frame_id.lstrip('/')))
        while stamp - self._wrenches[0].stamp_s > 5.0:
            self._wrenches.popleft()

    def pose(self, frame: str, stamp: float) -> Pose | None:
        """Pose of a frame in the sensor frame at a time, s; None where the transforms do not cover that time.

        Raises LookupError, which lists the known frames, where no chain of transforms joins the two.
        """
        if self._frames.pose(frame, self.sensor_frame) is None:
            known = ', '.join(self._frames.frames) or 'none at all'
            raise LookupError(f'/tf does not join {frame!r} and {self.sensor_frame!r}; its frames are: {known}')
        return self._frames.pose(frame, self.sensor_frame, stamp)

    def force_sensor_pose(self, stamp: float) -> Pose | None:
        """Pose of the force sensor at a time, s; None before its next message. Raises LookupError as `pose`."""
        return self.pose(self._wrenches[-1].frame, stamp) if self._wrenches and self._wrenches[-1].stamp_s >= stamp else None

    def wrench_at(self, stamp: float) -> dict:
        """The fields of a Sample about the wrench; without a topic it counts as changing."""
        found, placed = next((each for each in reversed(self._wrenches) if each.stamp_s <= stamp), None), None
        try:
            placed = found and self.pose(found.frame, stamp)
        except LookupError as error:
            self._report('wrench', f'the wrench is not used: {error}')
        if placed is None:
            return {'wrench': np.full(6, np.nan), 'changed_s': stamp if found is None else found.changed_s}
        to_sensor = partial(wrench_at, rotation=placed[0], origin=placed[1])
        return {'wrench': found.value, 'changed_s': found.changed_s, 'to_sensor': to_sensor}

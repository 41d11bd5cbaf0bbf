# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a recording says of its sensor before all else: its description, and on /tf_static where its camera, its tip or its cells are."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import cv2
import numpy as np
import yaml
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import String
from tactile_driver.nodes.messages.conversions import header_of
from tactile_perception.nodes.messages.conversions import vector
from tf2_msgs.msg import TFMessage

_UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def place(frame_id: str, name: str, translation: Sequence[float], rotation: Sequence[float] = _UPRIGHT,
          stamp: Time | None = None) -> TransformStamped:
    """Frame <frame_id>_<name> at translation, m, turned by a quaternion x, y, z, w."""
    told = TransformStamped(child_frame_id=f'{frame_id}_{name}')
    told.header.frame_id, told.header.stamp = frame_id, stamp or Time()
    told.transform.translation = vector(translation)
    turned = told.transform.rotation
    turned.x, turned.y, turned.z, turned.w = map(float, rotation)
    return told


def camera_pose(rotation: np.ndarray, translation: np.ndarray) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """(translation, quaternion) of a camera in the sensor frame, of what takes a point from the sensor's to the camera's frame: rotation
    (3,), a rotation vector, rad, and translation (3,), m."""
    angle = float(np.linalg.norm(rotation))
    axis = -np.asarray(rotation, float) * (np.sin(angle / 2) / angle) if angle else np.zeros(3)
    return -cv2.Rodrigues(np.asarray(rotation, float))[0].T @ translation, (*axis, np.cos(angle / 2))


def introduction(stamp_ns: int, sensor_type: str, frame_id: str, about: Mapping, places: Sequence[TransformStamped]) -> Iterator[tuple]:
    """(stamp, ns, topic, message) of a simulated sensor's description, as its driver gives it, and of its frames. about: what is known
    of the scene, as plain values."""
    described = {'sensor_type': sensor_type, 'frame_id': frame_id, 'source': 'sim', 'device': f'simulated {sensor_type}', **about}
    yield stamp_ns, 'description', String(data=yaml.safe_dump(described, sort_keys=False))
    for told in places:
        told.header.stamp = header_of(stamp_ns, frame_id).stamp
    yield stamp_ns, '/tf_static', TFMessage(transforms=list(places))

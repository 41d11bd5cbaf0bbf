# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The description and the static transforms of a sensor as messages: what every recording begins with."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import cv2
import numpy as np
import yaml
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import String
from tactile_driver.nodes.messages.conversions import header_of, vector
from tf2_msgs.msg import TFMessage

_IDENTITY = (0.0, 0.0, 0.0, 1.0)


def static_transform(frame_id: str, name: str, translation: Sequence[float], rotation: Sequence[float] = _IDENTITY,
                     stamp: Time | None = None) -> TransformStamped:
    """The pose of frame <frame_id>_<name> in frame_id: translation (3,), m, and rotation, a quaternion x, y, z, w."""
    transform = TransformStamped(child_frame_id=f'{frame_id}_{name}')
    transform.header.frame_id, transform.header.stamp = frame_id, stamp or Time()
    transform.transform.translation = vector(translation)
    quaternion = transform.transform.rotation
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = map(float, rotation)
    return transform


def camera_pose(rotation: np.ndarray, translation: np.ndarray) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """The pose of a camera in the sensor frame as (translation (3,), m, quaternion x, y, z, w).

    rotation: (3,) rotation vector, rad, and translation: (3,), m, of the transform from sensor to camera coordinates, the inverse.
    """
    angle = float(np.linalg.norm(rotation))
    axis = -np.asarray(rotation, float) * (np.sin(angle / 2) / angle) if angle else np.zeros(3)
    return -cv2.Rodrigues(np.asarray(rotation, float))[0].T @ translation, (*axis, np.cos(angle / 2))


def description_messages(stamp_ns: int, sensor_type: str, frame_id: str, about: Mapping,
                         transforms: Sequence[TransformStamped]) -> Iterator[tuple[int, str, object]]:
    """(stamp, ns, topic, message) of the description, as a driver publishes it, and of /tf_static.

    about: source and what else is known, as plain values; transforms: of the sensor's own frames.
    """
    text = yaml.safe_dump({'sensor_type': sensor_type, 'frame_id': frame_id, **about}, sort_keys=False)
    yield stamp_ns, 'description', String(data=text)
    for transform in transforms:
        transform.header.stamp = header_of(stamp_ns, frame_id).stamp
    yield stamp_ns, '/tf_static', TFMessage(transforms=list(transforms))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Static transforms of a sensor's own frames: its cameras, its tip, its taxels."""
from __future__ import annotations

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped

from .conversions import vector
from ...frame_names import optical_frame

_IDENTITY = (0.0, 0.0, 0.0, 1.0)
Pose = tuple[Sequence[float], Sequence[float]]  # rotation vector (3,), rad, and translation (3,), m, from sensor to camera coordinates


def static_transform(frame_id: str, child: str, translation: Sequence[float], rotation: Sequence[float] = _IDENTITY,
                     stamp: Time | None = None) -> TransformStamped:
    """The pose of the frame child in frame_id: translation (3,), m, and rotation, a quaternion x, y, z, w."""
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = frame_id, stamp or Time()
    transform.transform.translation = vector(translation)
    quaternion = transform.transform.rotation
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = map(float, rotation)
    return transform


def camera_transforms(frame_id: str, poses: Mapping[str, Pose], stamp: Time | None = None) -> list[TransformStamped]:
    """The poses of the cameras' optical frames in the sensor frame; poses: by view ('' for the only one or the stitched picture)."""
    return [static_transform(frame_id, optical_frame(frame_id, view), *_inverse(*pose), stamp) for view, pose in poses.items()]


def _inverse(rotation: Sequence[float], translation: Sequence[float]) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """The pose of a camera in the sensor frame: translation (3,), m, and quaternion x, y, z, w."""
    rotation, translation = np.asarray(rotation, float), np.asarray(translation, float)
    angle = float(np.linalg.norm(rotation))
    axis = -rotation * (np.sin(angle / 2) / angle) if angle else np.zeros(3)
    return -cv2.Rodrigues(rotation)[0].T @ translation, (*axis, np.cos(angle / 2))

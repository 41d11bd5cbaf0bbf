# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Conversions between messages and the drivers' frames, arrays, stamps and poses."""
from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Point32, Polygon, TransformStamped, Vector3
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, TimeReference
from std_msgs.msg import Header

from tactile_msgs.msg import PsdVoltages

from ...errors import BadFrame
from ...frame import CameraCalibration, Frame, SampleBlock, as_encoding, frame_of
from ...frame_names import optical_frame
from ...sources.source import NS
from .images import array_to_image, image_to_array

#: topic of two cameras: when the right view of a picture was exposed
RIGHT_TIME = 'right/time_reference'


def header_of(stamp_ns: int, frame_id: str) -> Header:
    """A header with the stamp stamp_ns, ns."""
    return Header(stamp=Time(sec=stamp_ns // NS, nanosec=stamp_ns % NS), frame_id=frame_id)


def right_time_message(right_ns: int, header: Header) -> TimeReference:
    """The time right_ns, ns, at which the right view of the picture with this header was exposed."""
    return TimeReference(header=header, time_ref=Time(sec=right_ns // NS, nanosec=right_ns % NS), source='right camera')


def stamp_ns_of(header: Header) -> int:
    """The header's stamp, ns. Raises BadFrame for an invalid one: before 1970, or with nanosec of a second or more."""
    stamp = header.stamp
    if stamp.sec < 0 or stamp.nanosec >= NS:
        raise BadFrame(f'stamp {stamp.sec} s + {stamp.nanosec} ns is not a valid time; the publisher needs a clock that counts from 1970')
    return stamp.sec * NS + stamp.nanosec


def frame_of_message(message: Image | CompressedImage, label: str) -> Frame:
    """The Frame of an image message; label: its name in error messages. Raises BadFrame if the message holds no valid image."""
    return frame_of(image_to_array(message, label), label, stamp_ns_of(message.header))


def image_to_message(frame: Frame, encoding: str, header: Header) -> Image:
    """The frame as an Image in encoding bgr8 or mono8, '' for the frame's own."""
    return array_to_image(as_encoding(frame, encoding), encoding or frame.encoding, header)


def bytes_of(values: np.ndarray) -> array:
    """The bytes of an array, for a message's data. Make the message with check_fields=True, and set its data afterwards: then rclpy takes
    the array('B') as it is, else it copies it twice."""
    data = array('B')
    data.frombytes(memoryview(np.ascontiguousarray(values)).cast('B'))
    return data


def calibration_to_message(calibration: CameraCalibration, header: Header | None = None) -> CameraInfo:
    """The calibration as a CameraInfo, under a header where there is one."""
    return CameraInfo(header=header or Header(), width=calibration.width, height=calibration.height, distortion_model=calibration.model,
                      d=list(calibration.d), k=list(calibration.k), r=list(calibration.r), p=list(calibration.p))


def point(values: np.ndarray) -> Point:
    """A label (3,), m."""
    x, y, z = map(float, values)
    return Point(x=x, y=y, z=z)


def vector(values: np.ndarray) -> Vector3:
    """A direction, displacement, force or velocity (3,)."""
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def polygon(points: np.ndarray) -> Polygon:
    """Points (n, 3), m, as a Polygon."""
    return Polygon(points=[Point32(x=x, y=y, z=z) for x, y, z in np.asarray(points, float).tolist()])


def voltages_message(block: SampleBlock, frame_id: str) -> PsdVoltages:
    """The block as a message."""
    data = array('f')
    data.frombytes(np.ascontiguousarray(block.volts, np.float32).tobytes())
    return PsdVoltages(header=header_of(block.stamp_ns, frame_id), sample_period=float(block.period_s), voltages=data)


def instants(touching: np.ndarray) -> list[int]:
    """The first sample of a block and those at which contacts begin or end. touching: (N,) number of contacts at each sample."""
    return [0, *(np.flatnonzero(np.diff(touching)) + 1).tolist()]


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


def quaternion_of(turn: Sequence[float]) -> tuple[float, float, float, float]:
    """The quaternion x, y, z, w of a rotation vector (3,), rad."""
    turn = np.asarray(turn, float)
    angle = float(np.linalg.norm(turn))
    return *(turn * (np.sin(angle / 2) / angle if angle else 0.5)).tolist(), float(np.cos(angle / 2))


def _inverse(rotation: Sequence[float], translation: Sequence[float]) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """The pose of a camera in the sensor frame: translation (3,), m, and quaternion x, y, z, w."""
    rotation = np.asarray(rotation, float)
    return -cv2.Rodrigues(rotation)[0].T @ np.asarray(translation, float), quaternion_of(-rotation)

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
    """Make a header.

    Parameters
    ----------
    stamp_ns : int
        Stamp in ns since 1970.
    frame_id : str
        Frame of the message.

    Returns
    -------
    Header
    """
    return Header(stamp=Time(sec=stamp_ns // NS, nanosec=stamp_ns % NS), frame_id=frame_id)


def right_time_message(right_ns: int, header: Header) -> TimeReference:
    """Make the message about the exposure of the right view of a picture.

    Parameters
    ----------
    right_ns : int
        Time of the exposure in ns.
    header : Header
        Header of the picture.

    Returns
    -------
    TimeReference
    """
    return TimeReference(header=header, time_ref=Time(sec=right_ns // NS, nanosec=right_ns % NS), source='right camera')


def stamp_ns_of(header: Header) -> int:
    """Stamp of a header in ns.

    Parameters
    ----------
    header : Header
        Of any message.

    Returns
    -------
    int

    Raises
    ------
    BadFrame
        If the stamp is before 1970, or its nanosec is a second or more.
    """
    stamp = header.stamp
    if stamp.sec < 0 or stamp.nanosec >= NS:
        raise BadFrame(f'stamp {stamp.sec} s + {stamp.nanosec} ns is not a valid time; the publisher needs a clock that counts from 1970')
    return stamp.sec * NS + stamp.nanosec


def frame_of_message(message: Image | CompressedImage, label: str) -> Frame:
    """Frame of an image message.

    Parameters
    ----------
    message : Image or CompressedImage
        See `images.image_to_array`.
    label : str
        Name of the image in error messages.

    Returns
    -------
    Frame

    Raises
    ------
    BadFrame
        If the message holds no valid image.
    """
    return frame_of(image_to_array(message, label), label, stamp_ns_of(message.header))


def image_to_message(frame: Frame, encoding: str, header: Header) -> Image:
    """Make the image message of a frame.

    Parameters
    ----------
    frame : Frame
        Image with its stamp.
    encoding : str
        bgr8 or mono8; empty: that of the frame.
    header : Header
        Header of the message.

    Returns
    -------
    Image
    """
    return array_to_image(as_encoding(frame, encoding), encoding or frame.encoding, header)


def bytes_of(values: np.ndarray) -> array:
    """Bytes of an array for the data of a message.

    Parameters
    ----------
    values : ndarray
        Of any type and shape.

    Returns
    -------
    array of unsigned char

    Notes
    -----
    Make the message with ``check_fields=True``, and set its data afterwards: then rclpy uses the array as it is, else it copies it twice.
    """
    data = array('B')
    data.frombytes(memoryview(np.ascontiguousarray(values)).cast('B'))
    return data


def calibration_to_message(calibration: CameraCalibration, header: Header | None = None) -> CameraInfo:
    """Make the camera_info of a calibration.

    Parameters
    ----------
    calibration : CameraCalibration
        Zeros if the camera is not calibrated.
    header : Header, optional
        Header of the message.

    Returns
    -------
    CameraInfo
    """
    return CameraInfo(header=header or Header(), width=calibration.width, height=calibration.height, distortion_model=calibration.model,
                      d=list(calibration.d), k=list(calibration.k), r=list(calibration.r), p=list(calibration.p))


def point(values: np.ndarray) -> Point:
    """Make a point.

    Parameters
    ----------
    values : ndarray, shape (3,)
        Position in m.

    Returns
    -------
    Point
    """
    x, y, z = map(float, values)
    return Point(x=x, y=y, z=z)


def vector(values: np.ndarray) -> Vector3:
    """Make a vector.

    Parameters
    ----------
    values : ndarray, shape (3,)
        Direction, displacement, force or velocity.

    Returns
    -------
    Vector3
    """
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)


def polygon(points: np.ndarray) -> Polygon:
    """Make a polygon.

    Parameters
    ----------
    points : ndarray, shape (N, 3)
        Corners in m.

    Returns
    -------
    Polygon
    """
    return Polygon(points=[Point32(x=x, y=y, z=z) for x, y, z in np.asarray(points, float).tolist()])


def voltages_message(block: SampleBlock, frame_id: str) -> PsdVoltages:
    """Make the message of a block of voltages.

    Parameters
    ----------
    block : SampleBlock
        Samples of a PSD finger.
    frame_id : str
        Sensor frame.

    Returns
    -------
    PsdVoltages
    """
    data = array('f')
    data.frombytes(np.ascontiguousarray(block.volts, np.float32).tobytes())
    return PsdVoltages(header=header_of(block.stamp_ns, frame_id), sample_period=float(block.period_s), voltages=data)


def instants(touching: np.ndarray) -> list[int]:
    """Select the samples of a block at which its contacts are reported: the first, and those at which contacts begin or end.

    Parameters
    ----------
    touching : ndarray of int, shape (N,)
        Number of contacts at each sample.

    Returns
    -------
    list of int

    Examples
    --------
    >>> instants(np.array([0, 0, 1, 1, 0]))
    [0, 2, 4]
    """
    return [0, *(np.flatnonzero(np.diff(touching)) + 1).tolist()]


_IDENTITY = (0.0, 0.0, 0.0, 1.0)
Pose = tuple[Sequence[float], Sequence[float]]  # rotation vector (3,), rad, and translation (3,), m, from sensor to camera coordinates


def static_transform(frame_id: str, child: str, translation: Sequence[float], rotation: Sequence[float] = _IDENTITY,
                     stamp: Time | None = None) -> TransformStamped:
    """Make the transform of a frame in its parent.

    Parameters
    ----------
    frame_id, child : str
        Parent and child frame.
    translation : sequence of float, shape (3,)
        In m.
    rotation : sequence of float, shape (4,)
        Quaternion x, y, z, w.
    stamp : Time, optional
        0 by default.

    Returns
    -------
    TransformStamped
    """
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = frame_id, stamp or Time()
    transform.transform.translation = vector(translation)
    quaternion = transform.transform.rotation
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = map(float, rotation)
    return transform


def camera_transforms(frame_id: str, poses: Mapping[str, Pose], stamp: Time | None = None) -> list[TransformStamped]:
    """Make the transforms of the optical frames of cameras in the sensor frame.

    Parameters
    ----------
    frame_id : str
        Sensor frame.
    poses : Mapping
        View ('' for the only one or the stitched picture) to rotation vector in rad and translation in m, from sensor to camera
        coordinates.
    stamp : Time, optional
        0 by default.

    Returns
    -------
    list of TransformStamped
    """
    return [static_transform(frame_id, optical_frame(frame_id, view), *_inverse(*pose), stamp) for view, pose in poses.items()]


def quaternion_of(turn: Sequence[float]) -> tuple[float, float, float, float]:
    """Quaternion of a rotation vector.

    Parameters
    ----------
    turn : sequence of float, shape (3,)
        Rotation vector in rad.

    Returns
    -------
    tuple of float
        x, y, z, w.

    Examples
    --------
    >>> quaternion_of([0.0, 0.0, np.pi])[2:]
    (1.0, 6.123233995736766e-17)
    """
    turn = np.asarray(turn, float)
    angle = float(np.linalg.norm(turn))
    return *(turn * (np.sin(angle / 2) / angle if angle else 0.5)).tolist(), float(np.cos(angle / 2))


def _inverse(rotation: Sequence[float], translation: Sequence[float]) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """Pose of a camera in the sensor frame: translation (3,), m, and quaternion x, y, z, w."""
    rotation = np.asarray(rotation, float)
    return -cv2.Rodrigues(rotation)[0].T @ np.asarray(translation, float), quaternion_of(-rotation)

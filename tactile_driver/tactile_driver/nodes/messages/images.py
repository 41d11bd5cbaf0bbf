# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border where image messages become arrays, and arrays messages: checked here, converted by cv_bridge.

Jazzy's cv_bridge and the pure Python one of PyPI give the same arrays.
"""
from __future__ import annotations

from array import array
from collections.abc import Collection
from types import SimpleNamespace

import cv2
import numpy as np
from cv_bridge import CvBridge
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from ...errors import BadFrame
from ...frame import COMPRESSED

_BRIDGE = CvBridge()
_AS_THEY_ARE = ('bgr8', 'mono8', 'mono16', '8UC1', '8UC3')
_TO_BGR = ('rgb8', 'bgra8', 'rgba8', 'bayer_rggb8', 'bayer_bggr8', 'bayer_gbrg8')
#: What PyPI's cv_bridge lacks, or reads wrongly: encoding -> (encoding that it reads alike, the conversion to BGR of Jazzy's or None)
_BY_OPENCV = {
    'yuv422': ('8UC2', cv2.COLOR_YUV2BGR_UYVY), 'yuv422_yuy2': ('8UC2', cv2.COLOR_YUV2BGR_YUY2), '16UC1': ('mono16', None),
    'bayer_grbg8': ('mono8', cv2.COLOR_BayerGB2BGR), 'bayer_grbg16': ('mono16', cv2.COLOR_BayerGB2BGR),
    'bayer_rggb16': ('mono16', cv2.COLOR_BayerBG2BGR), 'bayer_bggr16': ('mono16', cv2.COLOR_BayerRG2BGR),
    'bayer_gbrg16': ('mono16', cv2.COLOR_BayerGR2BGR),
}
PICTURES = (*_AS_THEY_ARE, *_TO_BGR, *_BY_OPENCV)
GREY = ('mono8', '8UC1', 'mono16', '16UC1')
_TO_8_BITS = 255 / 65535  # derived: scale from 16 to 8 bits
_ENDS = {b'\x89PNG\r\n\x1a\n': b'IEND\xaeB`\x82', b'\xff\xd8\xff': b'\xff\xd9'}  # of PNG and JPEG: first bytes -> last ones


def message_type(kind: type, topic: str) -> type:
    """Type of the messages on a topic of images.

    Parameters
    ----------
    kind : type
        Type for an uncompressed topic.
    topic : str
        Name of the topic; one that ends in ``/compressed`` is of image_transport.

    Returns
    -------
    type
        CompressedImage instead of Image for a compressed topic; any other kind unchanged.
    """
    return CompressedImage if kind is Image and topic.endswith(COMPRESSED) else kind


def image_to_array(message: Image | CompressedImage, label: str = 'image') -> np.ndarray:
    """Pixels of an image message with 8 bits.

    Parameters
    ----------
    message : Image or CompressedImage
        In one of the encodings PICTURES; JPEG or PNG if compressed.
    label : str
        Name of the image in error messages.

    Returns
    -------
    ndarray of uint8, shape (H, W, 3) or (H, W)
        BGR of a colour image, or grey.

    Raises
    ------
    BadFrame
        If encoding, size or bytes make no image.
    """
    pixels = _decompressed(message, label) if hasattr(message, 'format') else _decoded(message, label, PICTURES)
    return cv2.convertScaleAbs(pixels, alpha=_TO_8_BITS) if pixels.dtype == np.uint16 else pixels


def grey_to_array(message: Image | CompressedImage, label: str = 'image') -> np.ndarray:
    """Pixels of a grey image message with all their bits.

    Parameters
    ----------
    message : Image or CompressedImage
        In one of the encodings GREY; JPEG or PNG if compressed.
    label : str
        Name of the image in error messages.

    Returns
    -------
    ndarray of uint8 or uint16, shape (H, W)

    Raises
    ------
    BadFrame
        If encoding, size or bytes make no image, or it has colours.
    """
    if not hasattr(message, 'format'):
        return _decoded(message, label, GREY)
    pixels = _decompressed(message, label)
    if pixels.ndim != 2:
        raise BadFrame(f'{label}: a compressed image in colour is not supported; the driver has to publish a grey one')
    return pixels


def array_to_image(pixels: np.ndarray, encoding: str, header: Header) -> Image:
    """Make an image message.

    Parameters
    ----------
    pixels : ndarray, shape (H, W) or (H, W, channels)
        Of the type and the channels of the encoding.
    encoding : str
        As in sensor_msgs/image_encodings.
    header : Header
        Header of the message.

    Returns
    -------
    Image
    """
    # One row by cv_bridge, all rows by frombytes: with 640 x 480 bgr8, PyPI's cv_bridge takes 1.6 ms for what takes 0.1 ms so.
    message = _BRIDGE.cv2_to_imgmsg(pixels[:1], encoding)
    message.header, message.height, message.data = header, len(pixels), array('B')
    message.data.frombytes(memoryview(np.ascontiguousarray(pixels)).cast('B'))
    return message


def _decoded(message: Image, label: str, usable: Collection[str]) -> np.ndarray:
    """BGR or grey pixels, uint8 or uint16, of an Image in one of the usable encodings."""
    height, width, step, encoding = message.height, message.width, message.step, message.encoding
    if encoding not in usable:
        raise BadFrame(f'{label}: encoding {encoding[:40]!r} is not supported; the driver has to publish one of {", ".join(usable)}')
    read_as, conversion = _BY_OPENCV.get(encoding, (encoding, None))
    depth, channels = _BRIDGE.encoding_to_dtype_with_channels(read_as)
    row = width * channels * np.dtype(depth).itemsize
    if height * step != len(message.data) or step < row or not height * width:
        raise BadFrame(f'{label}: {height} rows of {step} bytes, {width} {encoding} each, do not make the {len(message.data)} bytes of '
                       'data; it is skipped')
    if encoding.startswith('yuv') and width % 2:
        raise BadFrame(f'{label}: {encoding} of odd width {width}; two pixels share their colour, the driver has to publish both')
    # PyPI's cv_bridge takes no padded rows, and no version of it takes big-endian data with NumPy 2.
    rows = np.frombuffer(message.data, np.uint8).reshape(height, step)[:, :row]
    if message.is_bigendian and depth == 'uint16':
        rows = rows.reshape(height, -1, 2)[:, :, ::-1]
    plain = SimpleNamespace(height=height, width=width, step=row, encoding=read_as, is_bigendian=False, data=np.ascontiguousarray(rows))
    try:
        pixels = _BRIDGE.imgmsg_to_cv2(plain, 'bgr8' if encoding in _TO_BGR else 'passthrough')
        return pixels if conversion is None else cv2.cvtColor(pixels, conversion)
    except Exception as error:  # of a type that depends on the version of cv_bridge
        raise BadFrame(f'{label}: cv_bridge cannot convert {width} x {height} {encoding}: {error}') from error


def _decompressed(message: CompressedImage, label: str) -> np.ndarray:
    """BGR or grey pixels, uint8 or uint16, of a JPEG or PNG image, whatever message.format says."""
    data = bytes(message.data)
    end = next((end for head, end in _ENDS.items() if data.startswith(head)), None)
    if end is None:
        raise BadFrame(f'{label}: {len(data)} bytes of a compressed image are neither JPEG nor PNG; set image_transport to one of both')
    if not data.rstrip(b'\0').endswith(end):  # some cameras pad a JPEG with zeros
        raise BadFrame(f'{label}: a compressed image of {len(data)} bytes is truncated; it is skipped')
    try:
        # As Jazzy's cv_bridge decodes it; PyPI's reduces it to 8 bits.
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise BadFrame(f'{label}: OpenCV cannot decode it: {error}') from error
    if pixels is None:
        raise BadFrame(f'{label}: {len(data)} bytes of a compressed image cannot be decoded; it is skipped')
    return cv2.cvtColor(pixels, cv2.COLOR_BGRA2BGR) if pixels.ndim == 3 and pixels.shape[2] == 4 else pixels

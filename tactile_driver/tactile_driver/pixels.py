# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Converts the bytes of an image message to an array. No ROS here.

cv_bridge is not used: depending on its version it raises AttributeError or KeyError for big-endian images and unknown encodings.
"""
from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from .errors import BadFrame

#: Encoding -> (channels, type of a channel, OpenCV conversion code to BGR; None for BGR and grey images)
_ENCODINGS = {
    'bgr8': (3, np.uint8, None), 'rgb8': (3, np.uint8, cv2.COLOR_RGB2BGR), 'bgra8': (4, np.uint8, cv2.COLOR_BGRA2BGR),
    'rgba8': (4, np.uint8, cv2.COLOR_RGBA2BGR), 'yuv422': (2, np.uint8, cv2.COLOR_YUV2BGR_UYVY),
    'yuv422_yuy2': (2, np.uint8, cv2.COLOR_YUV2BGR_YUY2), 'mono8': (1, np.uint8, None), 'mono16': (1, np.uint16, None),
}
PICTURES, GREY = tuple(_ENCODINGS), ('mono8', 'mono16')
_TO_8_BITS = 255 / 65535  # derived: scale from 16 to 8 bits


def pixels_of(data: Sequence[int], size: tuple[int, int, int], encoding: str, big_endian: bool, place: str,
              usable: Sequence[str] = PICTURES) -> np.ndarray:
    """The pixels (height, width) or (height, width, channels), uint8 or uint16, in the bytes of an image message.

    size: (height, width, step in bytes); place: names the image in error messages; usable: accepted encodings. Raises BadFrame for another
    encoding and for a length of data that does not match the size.
    """
    height, width, step = size
    if encoding not in usable:
        raise BadFrame(f'{place}: encoding {encoding[:40]!r} is not supported; the driver has to publish one of {", ".join(usable)}')
    channels, kind, _ = _ENCODINGS[encoding]
    kind = np.dtype(kind).newbyteorder('>' if big_endian else '<')
    row = width * channels * kind.itemsize
    if height * step != len(data) or step < row or not height * width:
        raise BadFrame(f'{place}: {height} rows of {step} bytes, {width} {encoding} each, do not make the {len(data)} bytes of data; '
                       'the frame is cut')
    rows = np.asarray(data, np.uint8).reshape(height, step)[:, :row]
    pixels = rows if kind.itemsize == 1 else np.ascontiguousarray(rows).view(kind).astype(kind.newbyteorder('='), copy=False)
    return np.ascontiguousarray(pixels.reshape(height, width, channels) if channels > 1 else pixels)


def picture_of(data: Sequence[int], size: tuple[int, int, int], encoding: str, big_endian: bool, place: str) -> np.ndarray:
    """As pixels_of, converted to (H, W) uint8 for a grey image and to (H, W, 3) uint8 BGR for a colour image."""
    pixels = pixels_of(data, size, encoding, big_endian, place)
    to_bgr = _ENCODINGS[encoding][2]
    if pixels.ndim == 3 and pixels.shape[2] == 2 and pixels.shape[1] % 2:
        raise BadFrame(f'{place}: {encoding} of odd width {pixels.shape[1]}; two pixels share their colour, the driver has to publish both')
    if to_bgr is not None:
        return cv2.cvtColor(pixels, to_bgr)
    return cv2.convertScaleAbs(pixels, alpha=_TO_8_BITS) if pixels.dtype == np.uint16 else pixels

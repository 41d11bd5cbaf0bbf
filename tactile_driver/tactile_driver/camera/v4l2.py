# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a V4L2 driver offers and its controls, by the ioctls of linux/videodev2.h; OpenCV, which reads the images, knows neither."""
from __future__ import annotations

import errno
import fcntl
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass

_READ_WRITE, _DISCRETE, _NEXT = 3, 1, 0xC0000000  # _IOC_READ | _IOC_WRITE; V4L2_FRMSIZE_TYPE_DISCRETE; V4L2_CTRL_FLAG_NEXT_(COMPOUND)
_CAPTURE, _CAPTURE_PLANES = 1, 9  # V4L2_BUF_TYPE_VIDEO_CAPTURE(_MPLANE)
_CONTROL_CLASS, _OFF = 6, 0x1 | 0x4  # V4L2_CTRL_TYPE_CTRL_CLASS; V4L2_CTRL_FLAG_DISABLED | _READ_ONLY
_CAPABILITY = struct.Struct('16s32s32s6I')  # driver, card, bus_info, version, capabilities
_FORMAT = struct.Struct('3I32s5I')  # index, type, flags, description, pixelformat
_SIZE = struct.Struct('11I')  # index, pixelformat, type, then width, height or least, most and step of both
_INTERVAL = struct.Struct('13I')  # index, pixelformat, width, height, type, then s as a fraction or least, most and step
_QUERY = struct.Struct('II32sqqQqIIII4I32I')  # id, type, name, minimum, maximum, step, default, flags
_CONTROL = struct.Struct('Ii')  # id, value
_QUERYCAP, _ENUM_FMT, _ENUM_FRAMESIZES, _ENUM_FRAMEINTERVALS, _QUERY_EXT_CTRL, _G_CTRL, _S_CTRL = 0, 2, 74, 75, 103, 27, 28


@dataclass(frozen=True)
class Mode:
    """What a camera offers: FOURCC, width and height, px, and its highest rate, Hz (0 if it tells none)."""

    pixel_format: str
    width: int
    height: int
    rate: float


@dataclass(frozen=True)
class Control:
    """A control: V4L2's id, the driver's name of it, and its range."""

    id: int
    name: str
    minimum: int
    maximum: int
    default: int


def fourcc(code: int) -> str:
    """The letters of a pixel format."""
    return code.to_bytes(4, 'little').decode('ascii', 'replace').strip('\0 ')


class VideoNode:
    """An open /dev/videoN, beside whoever reads its images; use it in a with statement. Raises OSError where the driver refuses."""

    def __init__(self, path: str):
        self._handle = os.open(path, os.O_RDWR | os.O_NONBLOCK)

    def __enter__(self) -> VideoNode:
        return self

    def __exit__(self, *_exc) -> None:
        os.close(self._handle)

    def _ask(self, number: int, kind: struct.Struct, *first: int, direction: int = _READ_WRITE) -> tuple:
        """What the driver makes of a structure of this kind whose first numbers are these, the others 0."""
        data = bytearray(kind.size)
        struct.pack_into(f'{len(first)}I', data, 0, *(value & 0xffffffff for value in first))
        fcntl.ioctl(self._handle, direction << 30 | kind.size << 16 | ord('V') << 8 | number, data)
        return kind.unpack(data)

    def _each(self, number: int, kind: struct.Struct, *values) -> Iterator[tuple]:
        for index in range(1000):
            try:
                yield self._ask(number, kind, index, *values)
            except OSError as error:
                if error.errno in (errno.EINVAL, errno.ENOTTY):  # the end of the list; no such list
                    return
                raise

    def bus(self) -> str:
        """The name of its place, as in usb-0000:00:14.0-1 or platform:vivid-000."""
        return _text(self._ask(_QUERYCAP, _CAPABILITY, direction=2)[2])

    def modes(self) -> list[Mode]:
        """Every offered mode of discrete or largest size, in the driver's order."""
        formats = [found[4] for kind in (_CAPTURE, _CAPTURE_PLANES) for found in self._each(_ENUM_FMT, _FORMAT, kind)]
        found = []
        for code in formats:
            for size in self._each(_ENUM_FRAMESIZES, _SIZE, code):
                width, height = size[3:5] if size[2] == _DISCRETE else (size[4], size[7])
                found.append(Mode(fourcc(code), width, height, self._fastest(code, width, height)))
        return found

    def _fastest(self, code: int, width: int, height: int) -> float:
        """The highest rate, Hz: the first interval of a range is the shortest."""
        periods = [each[5] / each[6] for each in self._each(_ENUM_FRAMEINTERVALS, _INTERVAL, code, width, height) if each[6]]
        return 1 / min(periods) if periods and min(periods) > 0 else 0.0

    def controls(self) -> list[Control]:
        """The controls that may be set."""
        found, last = [], 0
        while True:
            try:
                each = self._ask(_QUERY_EXT_CTRL, _QUERY, last | _NEXT)
            except OSError:
                return found
            last = each[0]
            if each[1] != _CONTROL_CLASS and not each[7] & _OFF:
                found.append(Control(last, _text(each[2]), each[3], each[4], each[6]))

    def get(self, control: int) -> int:
        """The value of a control by its id."""
        return self._ask(_G_CTRL, _CONTROL, control)[1]

    def set(self, control: int, value: int) -> None:
        """Set a control by its id."""
        self._ask(_S_CTRL, _CONTROL, control, value)


def _text(data: bytes) -> str:
    return data.partition(b'\0')[0].decode(errors='replace')

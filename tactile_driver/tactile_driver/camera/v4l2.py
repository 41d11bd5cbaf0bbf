# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a V4L2 driver offers and its controls, by the ioctls of linux/videodev2.h; OpenCV, which reads the images, knows neither.

Below them those controls that matter for colour and motion, and the choice of the pixel format.
"""
from __future__ import annotations

import errno
import fcntl
import os
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

from .constants import CAMERA

_READ_WRITE, _DISCRETE, _NEXT = 3, 1, 0xC0000000  # _IOC_READ | _IOC_WRITE; V4L2_FRMSIZE_TYPE_DISCRETE; V4L2_CTRL_FLAG_NEXT_(COMPOUND)
_CAPTURE, _CAPTURE_PLANES = 1, 9  # V4L2_BUF_TYPE_VIDEO_CAPTURE(_MPLANE)
_CONTROL_CLASS, _OFF = 6, 0x1 | 0x4  # V4L2_CTRL_TYPE_CTRL_CLASS; V4L2_CTRL_FLAG_DISABLED | _READ_ONLY
_CAPABILITY = struct.Struct('16s32s32s6I')  # driver, card, bus_info, version, capabilities
_FORMAT = struct.Struct('3I32s5I')  # index, type, flags, description, pixelformat
_SIZE = struct.Struct('11I')  # index, pixelformat, type, then width, height or minimum, maximum and step of both
_INTERVAL = struct.Struct('13I')  # index, pixelformat, width, height, type, then s as a fraction or minimum, maximum and step
_QUERY = struct.Struct('II32sqqQqIIII4I32I')  # id, type, name, minimum, maximum, step, default, flags
_CONTROL = struct.Struct('Ii')  # id, value


class _Ioctl(IntEnum):
    """Numbers of the requests VIDIOC_*."""

    QUERYCAP = 0
    ENUM_FMT = 2
    G_CTRL = 27
    S_CTRL = 28
    ENUM_FRAMESIZES = 74
    ENUM_FRAMEINTERVALS = 75
    QUERY_EXT_CTRL = 103


@dataclass(frozen=True)
class Mode:
    """What a camera offers: FOURCC, width and height, px, and its highest rate, Hz (0 if it reports none)."""

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
        """Name of the bus, as in usb-0000:00:14.0-1 or platform:vivid-000."""
        return _text(self._ask(_Ioctl.QUERYCAP, _CAPABILITY, direction=2)[2])

    def modes(self) -> list[Mode]:
        """Every offered mode of discrete or largest size, in the driver's order."""
        formats = [found[4] for kind in (_CAPTURE, _CAPTURE_PLANES) for found in self._each(_Ioctl.ENUM_FMT, _FORMAT, kind)]
        found = []
        for code in formats:
            for size in self._each(_Ioctl.ENUM_FRAMESIZES, _SIZE, code):
                width, height = size[3:5] if size[2] == _DISCRETE else (size[4], size[7])
                found.append(Mode(fourcc(code), width, height, self._fastest(code, width, height)))
        return found

    def _fastest(self, code: int, width: int, height: int) -> float:
        """The highest rate, Hz: the first interval of a range is the shortest."""
        periods = [each[5] / each[6] for each in self._each(_Ioctl.ENUM_FRAMEINTERVALS, _INTERVAL, code, width, height) if each[6]]
        return 1 / min(periods) if periods and min(periods) > 0 else 0.0

    def controls(self) -> list[Control]:
        """The controls that may be set."""
        found, last = [], 0
        while True:
            try:
                each = self._ask(_Ioctl.QUERY_EXT_CTRL, _QUERY, last | _NEXT)
            except OSError:
                return found
            last = each[0]
            if each[1] != _CONTROL_CLASS and not each[7] & _OFF:
                found.append(Control(last, _text(each[2]), each[3], each[4], each[6]))

    def get(self, control: int) -> int:
        """The value of a control by its id."""
        return self._ask(_Ioctl.G_CTRL, _CONTROL, control)[1]

    def set(self, control: int, value: int) -> None:
        """Set a control by its id."""
        self._ask(_Ioctl.S_CTRL, _CONTROL, control, value)


def _text(data: bytes) -> str:
    return data.partition(b'\0')[0].decode(errors='replace')


LEFT, AUTOMATIC = -1, 0  # values of every parameter: leave the camera's own; let the camera choose, where it can


@dataclass(frozen=True)
class _Setting:
    """A parameter. control, switch: V4L2 ids of the value and of its automatic, 0 for none; on: values of switch for automatic, the first
    that is taken; off: for manual; unit: of the control in the parameter's unit."""

    control: int
    switch: int = 0
    on: tuple[int, ...] = (1,)
    off: int = 0
    unit: float = 1.0


# V4L2_CID_ of linux/v4l2-controls.h. Exposure: V4L2_EXPOSURE_APERTURE_PRIORITY or _AUTO, and _MANUAL.
_SETTINGS = {'exposure': _Setting(0x9A0902, 0x9A0901, (3, 0), 1, 100e-6), 'gain': _Setting(0x980913, 0x980912),
             'white_balance': _Setting(0x98091A, 0x98090C), 'focus': _Setting(0x9A090A, 0x9A090C),
             'power_line_frequency': _Setting(0x980918)}
_LINE_MENU = {50: 1, 60: 2}  # V4L2_CID_POWER_LINE_FREQUENCY_50HZ, _60HZ
#: names of the parameters
CONTROLS = tuple(_SETTINGS)


def set_controls(node: VideoNode, wanted: Mapping[str, float]) -> list[str]:
    """Set the controls that are not LEFT. wanted: values of CONTROLS. Returns what the driver did not take, a sentence each."""
    warnings, offered = [], {control.id: control for control in node.controls()}
    for name, value in wanted.items():
        setting = _SETTINGS[name]
        if value == LEFT:
            continue
        if value == AUTOMATIC and setting.switch in offered:
            if not any(_taken(node, setting.switch, each) for each in setting.on):
                warnings.append(f'{name} does not become automatic: the driver refuses; set a value')
        elif setting.control not in offered:
            warnings.append(f'{name} {value:g} is not set: the camera has no such control; leave it at {LEFT}, or see '
                           'v4l2-ctl --list-ctrls for what it has')
        else:
            if setting.switch in offered:
                _taken(node, setting.switch, setting.off)
            count = _LINE_MENU.get(int(value), 0) if name == 'power_line_frequency' else round(value / setting.unit)
            if not _taken(node, setting.control, count):
                control, unit = offered[setting.control], setting.unit
                warnings.append(f'{name} {value:g} is not taken, the camera has {node.get(setting.control) * unit:g}; it offers '
                               f'{control.minimum * unit:g} to {control.maximum * unit:g}')
    return warnings


def _taken(node: VideoNode, control: int, value: int) -> bool:
    """Set a control; whether the driver has the value then."""
    try:
        node.set(control, value)
        return node.get(control) == value
    except OSError:
        return False


#: what OpenCV makes images of, the best colours first; grey only if nothing else carries the rate
READABLE = ('BGR3', 'RGB3', 'YUYV', 'UYVY', 'NV12', 'MJPG', 'GREY')


def chosen_format(modes: Sequence[Mode], size: tuple[int, int], rate: float) -> str:
    """The pixel format with the best colours that carries the rate, Hz, at the size, px, else the fastest; '' where none is known."""
    fitting = [mode for mode in modes if (mode.width, mode.height) == size and mode.pixel_format in READABLE and mode.rate > 0]
    fitting.sort(key=lambda mode: (-min(mode.rate, CAMERA.min_rate_share * rate), READABLE.index(mode.pixel_format)))
    return fitting[0].pixel_format if fitting else ''


_BYTES = {'BGR3': 3.0, 'RGB3': 3.0, 'YUYV': 2.0, 'UYVY': 2.0, 'NV12': 1.5, 'GREY': 1.0}


def exposure_of(node: VideoNode) -> float:
    """The exposure time, s; 0 where the camera does not report it."""
    try:
        return node.get(_SETTINGS['exposure'].control) * _SETTINGS['exposure'].unit
    except OSError:
        return 0.0


def limit_of(mode: Mode, bus: str, others: Sequence[str], exposure: float) -> str:
    """Why a camera may be slower than its nominal rate. bus: its name; others: cameras on the same bus; exposure: s, 0 if unknown."""
    if exposure * mode.rate > 1:
        return f'its exposure of {1e3 * exposure:.0f} ms is longer than a period; set exposure, and add light'
    load = _BYTES.get(mode.pixel_format, 0.0) * mode.width * mode.height * mode.rate / 1e6
    much = f'{mode.pixel_format} of {mode.width} x {mode.height} px{f" takes {load:.0f} MB/s of {bus}" if load else f" on {bus}"}'
    shared = f', which {" and ".join(others)} shares (plug one into another controller)' if others else ''
    return f'{much}{shared}, too little light (long exposure), or'

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The controls of a V4L2 camera that matter for colour and motion, and the choice of its pixel format."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .v4l2 import Mode, VideoNode

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
_CARRIES = 0.99  # share of the asked rate; drivers round intervals to 100 ns


def chosen_format(modes: Sequence[Mode], size: tuple[int, int], rate: float) -> str:
    """The pixel format with the best colours that carries the rate, Hz, at the size, px, else the fastest; '' where none is known."""
    fitting = [mode for mode in modes if (mode.width, mode.height) == size and mode.pixel_format in READABLE and mode.rate > 0]
    fitting.sort(key=lambda mode: (-min(mode.rate, _CARRIES * rate), READABLE.index(mode.pixel_format)))
    return fitting[0].pixel_format if fitting else ''


_BYTES = {'BGR3': 3.0, 'RGB3': 3.0, 'YUYV': 2.0, 'UYVY': 2.0, 'NV12': 1.5, 'GREY': 1.0}


def exposure_of(node: VideoNode) -> float:
    """The exposure time, s; 0 where the camera does not tell."""
    try:
        return node.get(_SETTINGS['exposure'].control) * _SETTINGS['exposure'].unit
    except OSError:
        return 0.0


def limit_of(mode: Mode, bus: str, others: Sequence[str], exposure: float) -> str:
    """Why a camera may be slower than it says. bus: its place; others: cameras on the same bus; exposure: s, 0 if not known."""
    if exposure * mode.rate > 1:
        return f'its exposure of {1e3 * exposure:.0f} ms is longer than a period, set exposure and more light'
    load = _BYTES.get(mode.pixel_format, 0.0) * mode.width * mode.height * mode.rate / 1e6
    much = f'{mode.pixel_format} of {mode.width} x {mode.height} px{f" takes {load:.0f} MB/s of {bus}" if load else f" on {bus}"}'
    shared = f', which {" and ".join(others)} shares (plug one into another controller)' if others else ''
    return f'{much}{shared}, too little light (long exposure), or'

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A V4L2 camera, read through OpenCV: found by name, and watched for frozen or black images."""
from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ..errors import BadArgument, DeviceLost
from ..frame import Frame, frame_of
from ..sources.source import Clock, Source, stamp_of
from .constants import CAMERA
from .v4l2 import CONTROLS, LEFT, READABLE, Mode, VideoNode, chosen_format, exposure_of, fourcc, limit_of, set_controls


@dataclass(frozen=True)
class VideoDevice:
    """One /dev/videoN. path; name: of the card; serial: USB serial number; by_id: name under /dev/v4l/by-id; bus: as v4l2-ctl
    --list-devices names it ('' where unknown); captures: whether it provides images."""

    path: str
    name: str
    serial: str
    by_id: str
    captures: bool
    bus: str = ''

    def __str__(self):
        known = ', '.join(x for x in (self.name, f'serial {self.serial}' if self.serial else '', self.by_id, self.bus) if x)
        return f'{self.path} ({known})' if known else self.path


def _text(path: Path) -> str:
    try:
        return path.read_text(errors='replace').strip()
    except OSError:
        return ''


def _serial(folder: Path) -> str:
    """USB serial number of a video node, from its interface or the next two parents; '' if unknown."""
    interface = (folder / 'device').resolve()
    return next((text for text in (_text(p / 'serial') for p in (interface, *list(interface.parents)[:2])) if text), '')


def _asked(path: str, what: Callable[[VideoNode], object], otherwise: object):
    """What a video node answers; otherwise, if it cannot be opened."""
    try:
        with VideoNode(path) as node:
            return what(node)
    except OSError:
        return otherwise


def list_devices(root: str = '/') -> list[VideoDevice]:
    """All video devices under root/sys/class/video4linux, sorted by number. A node of index 1 or higher provides metadata, no images."""
    base = Path(root)
    links = {link.resolve().name: link.name for link in sorted((base / 'dev/v4l/by-id').glob('*'))}
    folders = sorted((base / 'sys/class/video4linux').glob('video*'), key=lambda p: int(p.name[5:]) if p.name[5:].isdigit() else 0)
    return [VideoDevice(f'/dev/{f.name}', _text(f / 'name'), _serial(f), links.get(f.name, ''), _text(f / 'index') in ('', '0'),
                        _asked(f'{root}/dev/{f.name}', VideoNode.bus, '')) for f in folders]


def find_device(wanted: str, root: str = '/') -> VideoDevice:
    """The video device wanted: an index, a /dev path, a name under /dev/v4l/by-id, the name of its bus, or part of by-id or serial number.

    Raises DeviceLost, listing the existing devices, if none or several match.
    """
    devices = list_devices(root)
    names = {wanted, str(Path(wanted).resolve())} if wanted.startswith('/dev/') else {wanted}
    found = [d for d in devices if names & {d.path, d.path.removeprefix('/dev/video'), d.by_id, '/dev/v4l/by-id/' + d.by_id}]
    if not found and not wanted.isdigit() and not wanted.startswith('/dev/') and wanted:
        found = [d for d in devices if d.captures and (wanted == d.bus or wanted in d.by_id or wanted in d.serial)]
    if len(found) == 1:
        return found[0]
    known = '; '.join(map(str, devices)) or 'none at all'
    what = 'fits several video devices' if found else 'is not a video device'
    raise DeviceLost(f'device: {wanted!r} {what}; there are: {known}. Name one by index, path, bus or serial number, and check the cable')


class FrameWatch:
    """Watches the frames of one camera; warning describes a fault for as long as it lasts."""

    def __init__(self):
        self._last: np.ndarray | None = None
        self._seen_s = self._changed_s = self._bright_s = time.monotonic()

    def add(self, image: np.ndarray) -> None:
        """Add the image of the next frame, uint8 (H, W) or (H, W, 3)."""
        self._seen_s, rows = time.monotonic(), image[::CAMERA.row_step]
        if self._last is None or not np.array_equal(rows, self._last):
            self._last, self._changed_s = rows.copy(), self._seen_s
        if rows.mean() > CAMERA.max_black_mean:
            self._bright_s = self._seen_s

    @property
    def warning(self) -> str:
        """The fault and its remedy; '' without a fault or without recent frames."""
        if self._last is None or time.monotonic() - self._seen_s > CAMERA.max_image_age_s:
            return ''
        if self._seen_s - self._bright_s > CAMERA.black_s:
            return 'the images are black; check the lamps, the exposure and whether something covers the lens'
        same_s = self._seen_s - self._changed_s
        return f'the camera has sent the same image for {same_s:.1f} s; it hangs, unplug it and plug it in again' \
            if same_s > CAMERA.frozen_s else ''


class DeviceSource(Source):
    """A V4L2 camera.

    values: device: see find_device; width, height: px, rate: Hz, pixel_format: FOURCC, '' for the best that carries the rate; values of 0
    or below keep the camera's own; and those of CONTROLS. Raises BadArgument for a pixel_format that is not four letters.
    """

    live = True

    def __init__(self, values: Mapping, clock: Clock):
        if len(values['pixel_format']) not in (0, 4):
            raise BadArgument(f'pixel_format: {values["pixel_format"]!r} is not a FOURCC; give four letters such as MJPG, YUYV or GREY, '
                              'or leave it empty')
        self._watch = FrameWatch()
        self._asked, self._clock = values, clock
        self._found: VideoDevice | None = None
        self._capture = None
        self._wanted, self._changed, self._limit = {name: values[name] for name in CONTROLS}, True, ''
        self._of_mode, self._of_controls = [], []  # warnings

    def open(self) -> None:
        """Find the device, open it and apply the settings. Raises DeviceLost if it is missing (lists the existing devices) or busy."""
        self.close()
        self._found = find_device(self._asked['device'])
        self._capture = cv2.VideoCapture(self._found.path, cv2.CAP_V4L2)
        if not self._capture.isOpened():
            self.close()
            raise DeviceLost(f'device: {self._found} cannot be opened; another program may hold it, or the group "video" is missing')
        self._set_up()
        self._watch = FrameWatch()

    def _set_up(self) -> None:
        """Set the format, which determines the sizes and rates that are offered, then those; keep what was not taken."""
        capture, modes = self._capture, _asked(self._found.path, VideoNode.modes, [])
        width, height, rate, code = (self._asked[name] for name in ('width', 'height', 'rate', 'pixel_format'))
        if rate > 0 and not code:
            code = chosen_format(modes, (width or self._actual().width, height or self._actual().height), rate)
        if code:
            capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter_fourcc(*code))
        for prop, value in ((cv2.CAP_PROP_FRAME_WIDTH, width), (cv2.CAP_PROP_FRAME_HEIGHT, height), (cv2.CAP_PROP_FPS, rate)):
            if value > 0:
                capture.set(prop, value)
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        self._of_mode, self._changed = self._not_taken(modes), True

    def _actual(self) -> Mode:
        """The mode that the camera is in."""
        size = (int(self._capture.get(prop)) for prop in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        return Mode(fourcc(int(self._capture.get(cv2.CAP_PROP_FOURCC)) & 0xffffffff), *size, float(self._capture.get(cv2.CAP_PROP_FPS)))

    def _not_taken(self, modes: list[Mode]) -> list[str]:
        """What of pixel format and rate the camera does not give. The size is compared with the images themselves."""
        code, rate, has, warnings = self._asked['pixel_format'], self._asked['rate'], self._actual(), []
        if code and has.pixel_format != code:
            warnings.append(f'the camera gives {has.pixel_format} instead of {code}; it offers '
                           f'{", ".join(sorted({mode.pixel_format for mode in modes} & set(READABLE))) or "no other that can be read"}')
        if rate > 0 and abs(has.rate - rate) > CAMERA.rate_tolerance * rate:
            offered = [f'{mode.pixel_format} {mode.width} x {mode.height} up to {mode.rate:g} Hz' for mode in modes
                       if mode.rate >= rate][-CAMERA.max_listed_modes:]
            warnings.append(f'the camera is set to {has.rate:g} Hz instead of {rate:g} Hz at {has.pixel_format} {has.width} x '
                           f'{has.height} px; choose a rate, size and pixel_format that it offers '
                           f'({"; ".join(offered) or "none is that fast"})')
        return warnings

    def set_controls(self, values: Mapping[str, float]) -> None:
        """Set controls, see set_controls, before the next frame. Thread-safe."""
        self._wanted = {**self._wanted, **values}
        self._changed = True

    def _control(self) -> None:
        """Give the camera the wanted controls, note what it did not take, and what may limit its rate."""
        self._changed = False
        try:
            with VideoNode(self._found.path) as node:
                self._of_controls = set_controls(node, self._wanted)
                exposure = exposure_of(node)
        except OSError as error:
            self._of_controls, exposure = [], 0.0
            if any(value != LEFT for value in self._wanted.values()):
                self._of_controls = [f'the controls of {self._found.path} cannot be set: {error}; see who else holds it']
        bus = self._found.bus.rpartition('-')[0] or self._found.bus
        others = [each.path for each in list_devices() if each.captures and each.path != self._found.path and bus
                  and each.bus.startswith(bus + '-')] if bus.startswith('usb') else []
        self._limit = limit_of(self._actual(), bus, others, exposure)

    def read(self, wanted: bool = True) -> Frame | None:
        """The next frame; None if not wanted (then it is not decoded). Raises DeviceLost when the camera stops, BadFrame for a corrupt
        frame."""
        if self._capture is not None and self._changed:
            self._control()
        if self._capture is None or not self._capture.grab():
            name = self._found or self._asked['device']
            raise DeviceLost(f'device: {name} stopped sending frames; check the cable (the driver tries again by itself)')
        stamp = stamp_of(self._captured_ns(), self._clock)
        if not wanted:
            return None
        good, image = self._capture.retrieve()
        frame = frame_of(image if good else None, f'a frame of {self._found.path}', stamp)
        self._watch.add(frame.image)
        return frame

    @property
    def warning(self) -> str:
        """Warning about frozen or black images and about settings that the camera did not take, '' without one."""
        return '; '.join(text for text in (self._watch.warning, *self._of_mode, *self._of_controls) if text)

    def _captured_ns(self) -> int:
        """Capture time of the grabbed frame on time.monotonic_ns(): the V4L2 stamp if it is of this clock, else the present time."""
        now = time.monotonic_ns()
        stamp = int(self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        return stamp if 0 <= now - stamp < CAMERA.max_stamp_age_ns else now

    def close(self) -> None:
        """Release the camera."""
        if self._capture is not None:
            self._capture.release()
        self._capture = None

    def describe(self) -> dict:
        """The device and its actual mode."""
        about = {'device': self._asked['device']}
        if self._found:
            about.update((name, getattr(self._found, name)) for name in ('path', 'name', 'serial', 'by_id', 'bus'))
        if self._capture is not None:
            mode = self._actual()
            about.update(width=mode.width, height=mode.height, rate=mode.rate, pixel_format=mode.pixel_format, limit=self._limit)
        return about

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fake cameras: Linux' tree of video devices in a folder, and the frames OpenCV would read from them."""
from __future__ import annotations

import time
from pathlib import Path

import cv2
import numpy as np

RATE = 30.0


class FakeCamera:
    """Noise around a grey that is the camera's mark, at RATE."""

    def __init__(self, mark: int):
        self.mark, self.gone = mark, False
        self._rng = np.random.default_rng(mark)

    def picture(self) -> np.ndarray:
        """The next one, (H, W, 3)."""
        return self._rng.integers(self.mark, self.mark + 3, (48, 64, 3), np.uint8)


class Cameras:
    """The video devices below root, by their paths; opened as cv2.VideoCapture."""

    def __init__(self, root: Path):
        self.root, self._plugged = root, {}
        (root / 'dev/v4l/by-id').mkdir(parents=True)
        (root / 'sys/class/video4linux').mkdir(parents=True)

    def plug(self, serial: str, number: int, camera: FakeCamera) -> None:
        """Plug a camera in, which becomes /dev/videoN."""
        usb = self.root / f'sys/devices/usb_{serial}/interface'
        node = self.root / f'sys/class/video4linux/video{number}'
        for folder in (usb, node):
            folder.mkdir(parents=True, exist_ok=True)
        (usb.parent / 'serial').write_text(serial)
        for name, text in (('name', 'Pad'), ('index', '0')):
            (node / name).write_text(text)
        (node / 'device').symlink_to(usb)
        (self.root / f'dev/v4l/by-id/usb-Pad_{serial}-video-index0').symlink_to(f'../../video{number}')
        camera.gone = False
        self._plugged[f'/dev/video{number}'] = serial, camera

    def pull(self, number: int) -> None:
        """Pull the camera's cable."""
        serial, camera = self._plugged.pop(f'/dev/video{number}')
        camera.gone = True
        node = self.root / f'sys/class/video4linux/video{number}'
        for file in node.iterdir():
            file.unlink()
        node.rmdir()
        (self.root / f'dev/v4l/by-id/usb-Pad_{serial}-video-index0').unlink()

    def open(self, path: str, _backend: int) -> FakeCapture:
        """In place of cv2.VideoCapture."""
        return FakeCapture(self._plugged.get(path, (None, None))[1])


class FakeCapture:
    """What cv2.VideoCapture has."""

    def __init__(self, camera: FakeCamera | None):
        self._camera, self._due_s = camera, time.monotonic()

    def isOpened(self):  # noqa: N802
        return self._camera is not None

    def set(self, _prop, _value):
        return True

    def get(self, prop):
        if prop == cv2.CAP_PROP_POS_MSEC:
            return time.monotonic() * 1e3
        return {cv2.CAP_PROP_FRAME_WIDTH: 64, cv2.CAP_PROP_FRAME_HEIGHT: 48, cv2.CAP_PROP_FPS: RATE}.get(prop, 0)

    def grab(self):
        self._due_s = max(self._due_s + 1 / RATE, time.monotonic() - 1 / RATE)
        time.sleep(max(self._due_s - time.monotonic(), 0))
        return self._camera is not None and not self._camera.gone

    def retrieve(self):
        return True, self._camera.picture()

    def release(self):
        self._camera = None

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A camera that is unplugged and comes back as another device. What else cameras do: tactile_driver/test/camera and test/hardware."""
import shutil
import time
from functools import partial

import cv2
import numpy as np
import pytest
from fault_rig import ERROR, OK
from sensor_msgs.msg import Image

from tactile_driver.camera import device
from tactile_driver.nodes.camera_node import CameraNode

RATE = 30.0  # frames/s


class Camera:
    """What cv2.VideoCapture has: noise around a grey that is the camera's mark. marks: path -> mark of what is plugged in."""

    def __init__(self, marks, path):
        self._marks, self._path, self._mark, self._due_s = marks, path, marks.get(path), time.monotonic()
        self._rng = np.random.default_rng(0)

    def isOpened(self):  # noqa: N802
        return self._mark is not None

    def set(self, _prop, _value):
        return True

    def get(self, prop):
        if prop == cv2.CAP_PROP_POS_MSEC:
            return time.monotonic() * 1e3
        return {cv2.CAP_PROP_FRAME_WIDTH: 64, cv2.CAP_PROP_FRAME_HEIGHT: 48, cv2.CAP_PROP_FPS: RATE}.get(prop, 0)

    def grab(self):
        self._due_s = max(self._due_s + 1 / RATE, time.monotonic() - 1 / RATE)
        time.sleep(max(self._due_s - time.monotonic(), 0))
        return self._marks.get(self._path) == self._mark

    def retrieve(self):
        return True, self._rng.integers(self._mark, self._mark + 3, (48, 64, 3), np.uint8)

    def release(self):
        self._mark = None


class Cameras:
    """The video devices below root, as Linux has them in its trees /dev and /sys. marks: path -> mark of the camera."""

    def __init__(self, root):
        self.root, self.marks = root, {}
        (root / 'dev/v4l/by-id').mkdir(parents=True)

    def plug(self, serial, number, mark):
        """Plug a camera in, which becomes /dev/videoN."""
        usb, node = self.root / f'sys/devices/usb_{serial}/interface', self.root / f'sys/class/video4linux/video{number}'
        for folder in (usb, node):
            folder.mkdir(parents=True, exist_ok=True)
        (usb.parent / 'serial').write_text(serial)
        (node / 'name').write_text('Pad')
        (node / 'index').write_text('0')
        (node / 'device').symlink_to(usb)
        (self.root / f'dev/v4l/by-id/usb-Pad_{serial}-video-index0').symlink_to(f'../../video{number}')
        self.marks[f'/dev/video{number}'] = mark

    def pull(self, serial, number):
        """Pull the camera's cable."""
        del self.marks[f'/dev/video{number}']
        shutil.rmtree(self.root / f'sys/class/video4linux/video{number}')
        (self.root / f'dev/v4l/by-id/usb-Pad_{serial}-video-index0').unlink()


@pytest.fixture
def cameras(tmp_path, monkeypatch):
    made = Cameras(tmp_path)
    monkeypatch.setattr(device.cv2, 'VideoCapture', lambda path, _backend: Camera(made.marks, path))
    monkeypatch.setattr(device, 'find_device', partial(device.find_device, root=str(tmp_path)))
    return made


def first_after(heard, begin):
    """When the first message came after a time; None before."""
    return next((h.at for h in list(heard) if h.at > begin), None)


def test_plugged_in_again_as_another_video_device(bench, beside, nodes, cameras):
    space = bench.fresh('pad')
    node, heard = f'{space}/camera_node', bench.ear.hear(Image, f'{space}/image_raw')
    cameras.plug('A1', 0, mark=100)
    nodes(CameraNode, space, source='device', device='A1', width=64, height=48)
    bench.until(lambda: len(heard) > 5)
    pulled = time.monotonic()
    cameras.pull('A1', 0)
    reported = bench.reported(node, ERROR, 'device:', pulled)
    time.sleep(1.0)
    plugged = time.monotonic()
    cameras.plug('B2', 0, mark=200)
    cameras.plug('A1', 4, mark=100)
    bench.until(lambda: first_after(heard, plugged))
    back = bench.reported(node, OK, 'Hz', plugged)
    assert back.values['device'] == '/dev/video4' and back.values['serial'] == 'A1'
    assert {int(np.median(h.message.data)) for h in heard} == {101}, 'never the other camera'
    bench.report('camera plugged in again as another /dev/videoN', reported.text, first_after(heard, plugged) - plugged)

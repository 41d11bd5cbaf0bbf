# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A camera that is unplugged and comes back as another device. What else cameras do: tactile_driver/test/camera and test/hardware."""
import time
from functools import partial

import numpy as np
import pytest

from fake_cameras import Cameras, FakeCamera
from fault_rig import ERROR, OK
from sensor_msgs.msg import Image
from tactile_driver.nodes.camera_node import CameraNode
from tactile_driver.camera import device


@pytest.fixture
def cameras(tmp_path, monkeypatch):
    made = Cameras(tmp_path)
    monkeypatch.setattr(device.cv2, 'VideoCapture', made.open)
    monkeypatch.setattr(device, 'find_device', partial(device.find_device, root=str(tmp_path)))
    return made


def first_after(heard, begin):
    """When the first message came after a time; None before."""
    return next((h.at for h in list(heard) if h.at > begin), None)


def test_plugged_in_again_as_another_video_device(bench, beside, nodes, cameras):
    camera, space = FakeCamera(mark=100), bench.fresh('pad')
    node, heard = f'{space}/camera_node', bench.ear.hear(Image, f'{space}/image_raw')
    cameras.plug('A1', 0, camera)
    nodes(CameraNode, space, source='device', device='A1', width=64, height=48)
    bench.until(lambda: len(heard) > 5)
    pulled = time.monotonic()
    cameras.pull(0)
    reported = bench.reported(node, ERROR, 'device:', pulled)
    time.sleep(1.0)
    plugged = time.monotonic()
    cameras.plug('B2', 0, FakeCamera(mark=200))
    cameras.plug('A1', 4, camera)
    bench.until(lambda: first_after(heard, plugged))
    back = bench.reported(node, OK, 'Hz', plugged)
    assert back.values['device'] == '/dev/video4' and back.values['serial'] == 'A1'
    assert {int(np.median(h.message.data)) for h in heard} == {101}, 'never the other camera'
    bench.report('camera plugged in again as another /dev/videoN', reported.text, first_after(heard, plugged) - plugged)

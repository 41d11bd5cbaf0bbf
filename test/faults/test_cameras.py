# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Cameras that are unplugged, hang, send black images or change their image size."""
import time
from functools import partial

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from fake_cameras import Cameras, FakeCamera  # noqa: E402
from fault_rig import ERROR, OK, WARN  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from tactile_driver.nodes.camera_node import CameraNode  # noqa: E402
from tactile_driver.camera import device  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture
def cameras(tmp_path, monkeypatch):
    made = Cameras(tmp_path)
    monkeypatch.setattr(device.cv2, 'VideoCapture', made.open)
    monkeypatch.setattr(device, 'find_device', partial(device.find_device, root=str(tmp_path)))
    return made


@pytest.fixture
def pad(bench, nodes, cameras):
    """A camera of serial number A1 that runs: (camera, name of its node, its messages as they come)."""
    camera = FakeCamera(mark=100)
    cameras.plug('A1', 0, camera)
    space = bench.fresh('pad')
    heard = bench.ear.hear(Image, f'{space}/image_raw')
    nodes(CameraNode, space, source='device', device='A1', width=64, height=48)
    bench.until(lambda: len(heard) > 5)
    return camera, f'{space}/camera_node', heard


def first_after(heard, begin, good=lambda message: True):
    """When the first good message came after a time; None before."""
    return next((h.at for h in list(heard) if h.at > begin and good(h.message)), None)


def test_plugged_in_again_as_another_video_device(bench, beside, cameras, pad):
    camera, node, heard = pad
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


@pytest.mark.parametrize(('does', 'part'), [('repeats', 'has repeated one picture'), ('black', 'pictures are black')])
def test_pictures_of_a_camera_that_does_not_work_are_reported(bench, beside, pad, does, part):
    camera, node, _ = pad
    camera.does, begin = does, time.monotonic()
    reported = bench.reported(node, WARN, part, begin)
    assert reported.at - begin < 4.0 and reported.values['what to do'] == reported.text.split('; ')[1]
    camera.does, right = '', time.monotonic()
    well = bench.reported(node, OK, 'Hz', right)
    bench.report({'repeats': 'a camera repeats one picture', 'black': 'a camera sends black pictures'}[does], reported.text,
                 well.at - right)


def test_pictures_of_another_size_for_a_moment_are_skipped(bench, beside, pad):
    camera, node, heard = pad
    camera.does, begin = 'small', time.monotonic()
    text = bench.logged('32 x 24 px among frames of 64 x 48 px; it is skipped', begin)
    camera.does, right = '', time.monotonic()
    bench.until(lambda: first_after(heard, right))
    assert {(h.message.width, h.message.height) for h in heard} == {(64, 48)}
    well = bench.reported(node, OK, 'Hz', right)
    assert int(well.values['corrupt']) >= 1
    bench.report('a camera changes its size for a moment', text, first_after(heard, right) - right)


def test_a_camera_that_forgot_its_size_is_set_up_anew(bench, beside, pad):
    camera, _, heard = pad
    camera.forgets, camera.does, begin = True, 'small', time.monotonic()
    text = bench.logged('no others any more; the device is set up anew', begin)
    bench.until(lambda: first_after(heard, begin + 0.3))
    assert {(h.message.width, h.message.height) for h in heard} == {(64, 48)}
    bench.report('a camera changes its size, and obeys when asked anew', text, first_after(heard, begin + 0.3) - begin)


def test_a_camera_of_another_size_for_good_goes_on_with_it(bench, beside, pad):
    camera, node, heard = pad
    camera.does, begin = 'small', time.monotonic()
    bench.until(lambda: first_after(heard, begin, lambda message: message.width == 32))
    reported = bench.reported(node, WARN, 'the camera gives 32 x 24 px instead of 64 x 48 px', begin)
    bench.report('a camera changes its size for good', reported.text,
                 first_after(heard, begin, lambda message: message.width == 32) - begin)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The worked examples do what their page says: a source of one's own delivers, a method of one's own finds."""
import os
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
from pages import ROOT, files

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

PAGE = ROOT / 'docs' / 'extending.md'
PORT = 7100 + os.getpid() % 800
FIND = """
import runpy, sys
import numpy as np
from tactile_driver.simulation.sensors.scenes import open_scene
runpy.run_path(sys.argv[1])
from tactile_perception.dots.detect import DotDetector
scene = open_scene('rest', 30.0, 0)
frame, truth = scene.render(0.5).image, scene.observe(15).truth.dot_uv
found = DotDetector('dark', 'simple_blobs').detect(frame).uv
nearest = np.sqrt(((found[:, None] - truth[None]) ** 2).sum(-1)).min(1)
print(len(found), float(np.median(nearest)))
"""


@pytest.fixture
def images():
    """(images received, a function that waits for the next) on the example's topic."""
    rclpy.init()
    node, executor, received = rclpy.create_node('reader'), SingleThreadedExecutor(), []
    node.create_subscription(Image, '/taxel_array/image_raw', received.append, qos_profile_sensor_data)
    executor.add_node(node)
    yield received, executor
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()


def test_an_array_that_sends_datagrams_is_published(tmp_path, images):
    received, executor = images
    path = tmp_path / 'udp_array.py'
    path.write_text(files(PAGE)['udp_array.py'])
    process = subprocess.Popen([sys.executable, str(path), '--ros-args', '-r', '__ns:=/taxel_array', '-p', 'source:=udp', '-p',
                                f'device:="{PORT}"'], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    values = np.arange(44 * 44).reshape(44, 44).astype(np.uint8)
    sender, end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), time.monotonic() + 60
    while not received and time.monotonic() < end:
        sender.sendto(b'too short', ('127.0.0.1', PORT))
        sender.sendto(values.tobytes(), ('127.0.0.1', PORT))
        executor.spin_once(timeout_sec=0.05)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 0, said
    assert received and (received[0].height, received[0].width, received[0].encoding) == (44, 44, 'mono8')
    np.testing.assert_array_equal(np.frombuffer(received[0].data, np.uint8).reshape(44, 44), values)
    assert '9 bytes' in said


def test_a_method_of_ones_own_finds_the_dots(tmp_path):
    path = tmp_path / 'blob_tracker.py'
    path.write_text(files(PAGE)['blob_tracker.py'])
    reported = subprocess.run([sys.executable, '-c', FIND, str(path)], capture_output=True, text=True, timeout=90, check=True, cwd=tmp_path)
    count, error = reported.stdout.split()
    assert int(count) > 500 and float(error) < 0.3

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The worked examples do what their page says: a source of one's own delivers, a method of one's own finds, a seventh sensor runs."""
import os
import signal
import socket
import subprocess
import sys
import time

import numpy as np
from pages import ROOT, files
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.recordings.writer import write_messages

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


UNTOUCHED, PRESSED = [[10, 11], [12, 13]], [[40, 71], [22, 33]]  # counts of 0.1 N


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """A folder with the files of the page and a recording of ten frames, of which five are of a press."""
    path = tmp_path_factory.mktemp('plate')
    shown = files(ROOT / 'docs/extending.md')
    for name in ('plate.py', 'plate.yaml'):
        (path / name).write_text(shown[name])
    frames = [Frame(np.array(PRESSED if k >= 5 else UNTOUCHED, np.uint8), k, 'mono8') for k in range(10)]
    write_messages(path / 'bag', 'plate', [(k * 10**8 + 10**9, '/plate/image_raw',
                                            image_to_message(frame, '', header_of(k * 10**8 + 10**9, 'plate')))
                                           for k, frame in enumerate(frames)])
    return path


def run(folder, code, *words):
    """What a Python program prints that begins with the sensor type."""
    done = subprocess.run([sys.executable, '-c', f'import sys, plate\n{code}', *words], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_process_bag_computes_its_contacts(folder):
    run(folder, 'from tactile_perception.tools.process_bag import main\nsys.exit(main())', 'bag', 'results', '--params', 'plate.yaml')
    with BagReader(folder / 'results') as reader:
        found = [decode(raw.data, raw.type_name) for raw in reader.messages({'/plate/contacts'})]
    assert [len(message.contacts) for message in found] == [0] * 5 + [1] * 5
    contact = found[-1].contacts[0]
    assert contact.force == pytest.approx(12.0)  # 3, 6, 1 and 2 N at the corners of 0.3 m
    assert (contact.position.x, contact.position.y) == pytest.approx((0.05, 0.075))


def test_a_node_runs_it(folder):
    code = """
import rclpy
from tactile_driver.nodes.runtime.host import Host
from tactile_perception.node import make_node
rclpy.init()
node = make_node('plate_node', Host(['-r', '__ns:=/plate', '--params-file', 'plate.yaml']))
print(node.get_fully_qualified_name(), node.get_parameter('size').value)
node.destroy_node()
"""
    assert run(folder, code).split() == ['/plate/plate_node', '0.3']


def test_launch_starts_its_nodes(folder):
    code = """
from tactile_bringup.launch.arguments import sensor_arguments, sensor_plan
values = {name: default for name, (default, _) in sensor_arguments('plate').items()}
print(*sensor_plan(values | {'source': 'file', 'path': 'bag', 'params': 'plate.yaml'}, 'plate').nodes)
"""
    assert run(folder, code).split() == ['taxel_array_node', 'plate_node', 'taxel_markers_node']

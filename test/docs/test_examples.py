# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The worked examples do what their page says: a source of one's own delivers, a method of one's own finds, a sensor type of another
package runs."""
import os
import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
import rclpy
from pages import ROOT
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image

from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode

EXAMPLES = ROOT / 'docs' / 'examples'
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


def test_a_users_array_that_sends_datagrams_is_published(images):
    received, executor = images
    arguments = ['--ros-args', '-r', '__ns:=/taxel_array', '-p', 'source:=udp', '-p', f'device:="{PORT}"']
    process = subprocess.Popen([sys.executable, EXAMPLES / 'udp_array.py', *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               text=True)
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


def test_a_users_method_finds_the_dots(tmp_path):
    reported = subprocess.run([sys.executable, '-c', FIND, EXAMPLES / 'blob_tracker.py'], capture_output=True, text=True, timeout=90,
                              check=True, cwd=tmp_path)
    count, error = reported.stdout.split()
    assert int(count) > 500 and float(error) < 0.3


@pytest.fixture(scope='module')
def plate(tmp_path_factory):
    """A function that runs a command where the package tactile_plate is installed beside ours, and returns what it prints."""
    folder = tmp_path_factory.mktemp('plate')
    built = ['colcon', '--log-base', 'log', 'build', '--base-paths', str(ROOT / 'docs' / 'examples' / 'tactile_plate')]
    subprocess.run(built, cwd=folder, check=True, capture_output=True, timeout=120)

    def run(command, status=0):
        done = subprocess.run(['bash', '-c', f'source install/local_setup.bash && {command}'], cwd=folder, capture_output=True, text=True,
                              timeout=120)
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout + done.stderr
    run.folder = folder
    run('ros2 run tactile_bringup simulate plate plate_demo plate_bag')
    return run


def test_a_foreign_sensor_type_is_calibrated_processed_and_judged(plate):
    params = plate.folder / 'install/tactile_plate/share/tactile_plate/params/plate_sim.yaml'
    said = plate(f'ros2 run tactile_perception calibrate plate_bag --params {params} --output plate.yaml')
    newtons = float(re.search(r'([\d.]+) N per count', said)[1])
    assert newtons == pytest.approx(0.12, rel=0.005)
    plate(f'ros2 run tactile_perception process_bag plate_bag results --params {params} --calibration plate.yaml')
    with BagReader(plate.folder / 'results') as reader:
        found = [decode(raw.data, raw.type_name) for raw in reader.messages({'/plate/contacts'})]
    pressed = [message.contacts[0] for message in found if message.contacts]
    assert 0.75 * len(found) < len(pressed) < 0.85 * len(found)
    assert np.median([contact.force for contact in pressed]) == pytest.approx(20.0, abs=0.3)
    away = [np.hypot(contact.position.x, contact.position.y) for contact in pressed]
    assert np.median(away) == pytest.approx(0.08, abs=0.002)
    assert 'force' in plate('ros2 run tactile_perception evaluate results')


def test_a_calibration_of_another_plate_is_refused(plate):
    params = plate.folder / 'install/tactile_plate/share/tactile_plate/params/plate_sim.yaml'
    plate(f'ros2 run tactile_perception calibrate plate_bag --params {params} --output own.yaml')
    other = plate.folder / 'other.yaml'
    other.write_text(params.read_text().replace('size: 0.3', 'size: 0.4'))
    said = plate(f'ros2 run tactile_perception process_bag plate_bag others --params {other} --calibration own.yaml')
    assert 'size is 0.4, was 0.3' in said


def test_launch_files_and_the_hand_know_a_foreign_sensor_type(plate):
    assert "'plate'" in plate('ros2 launch tactile_plate plate.launch.py --show-args')
    (plate.folder / 'hand.yaml').write_text('frame: palm\nsensors:\n- {name: scale, type: plate, parent: palm}\n')
    plate('ros2 run tactile_bringup hand_config hand.yaml .')
    assert '/scale/markers' in (plate.folder / 'hand.rviz').read_text()
    (plate.folder / 'hand.yaml').write_text('frame: palm\nsensors:\n- {name: scale, type: plates, parent: palm}\n')
    said = plate('ros2 run tactile_bringup hand_config hand.yaml .', status=1)
    assert 'plates' in said and 'touchpad' in said and 'plate,' in said.replace('plate\n', 'plate,')


def test_a_launched_foreign_sensor_publishes(plate):
    command = 'source install/local_setup.bash && exec ros2 launch tactile_plate plate.launch.py'
    launched = subprocess.Popen(['bash', '-c', command], cwd=plate.folder, start_new_session=True, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True)
    try:
        echo = 'ros2 topic echo --once --filter "m.contacts" /plate/contacts tactile_msgs/msg/Contacts'
        assert 'position_covariance' in plate(f'timeout 100 {echo}')
    finally:
        os.killpg(launched.pid, signal.SIGINT)
        said = launched.communicate(timeout=60)[0]
    assert launched.returncode == 0 and 'Traceback' not in said, said

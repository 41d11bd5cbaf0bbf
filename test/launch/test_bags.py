# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are played: as what they were, to their end, with the truth that they have."""
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
import rclpy
from ament_index_python.packages import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import String
from waiting import until

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_psd_scene, write_scene, write_taxel_scene
from tactile_driver.nodes.camera_node import CameraNode
from tactile_driver.nodes.dual_camera_node import DualCameraNode
from tactile_driver.nodes.psd_node import PsdNode
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import BagWriter
from tactile_msgs.msg import Contacts, DotTracks
from tactile_perception.bags.replay import Replay
from tactile_perception.tools.process_bag import process_bag

FRAMES = 12
# sensor type: writer of a scene, a scene with contact, rate in Hz
SENSORS = {'areal_single': (write_scene, 'areal_single_press', 4.0), 'areal_dual': (write_scene, 'areal_dual_press', 4.0),
           'taxel_array': (write_taxel_scene, 'drag', 20.0)}


def write(folder, sensor_type, simulated=True):
    """A bag of a scene with annotated images beside the raw data; its path."""
    maker, scene, rate = SENSORS[sensor_type]
    maker(folder / 'plain', scene, rate, **({'frames': FRAMES} if maker is write_scene else {}))
    picture = encode(Image(width=1, height=1, step=1, encoding='mono8', data=b'1'))
    with BagReader(folder / 'plain') as reader, BagWriter(folder / 'bag') as writer:
        for message in reader.messages():
            data = message.data
            if message.topic.endswith('/description') and not simulated:
                text = decode(data, message.type_name).data
                data = encode(String(data=text.replace('source: sim', 'source: device')))[1]
            writer.write(message.topic, message.type_name, message.stamp_ns, data)
            writer.write(f'/{sensor_type}/image_annotated', picture[0], message.stamp_ns, picture[1])
    return str(folder / 'bag')


def test_a_simulated_sensor_is_replayed_as_what_it_was(ros2, listen, tmp_path):
    bag = write(tmp_path, 'areal_dual')
    launched = ros2('launch', 'tactile_bringup', 'areal_dual.launch.py', 'source:=bag', f'path:={bag}')
    ear = listen({'/areal_dual/contacts': Contacts})
    heard = ear.heard['/areal_dual/contacts']
    assert ear.wait_for(lambda: any(message.contacts for message in list(heard)), 120), launched.log
    assert launched.wait(120) == 0, launched.log
    assert launched.complaints == [], launched.log


def test_a_real_sensor_is_replayed_with_its_own_parameters(ros2, listen, tmp_path):
    bag = write(tmp_path, 'areal_single', simulated=False)
    launched = ros2('launch', 'tactile_bringup', 'areal_single.launch.py', 'source:=bag', f'path:={bag}', 'loop:=true')
    ear = listen({'/areal_single/dots': DotTracks})
    assert ear.wait_for(lambda: len(ear.heard['/areal_single/dots']) > 5, 120), launched.log
    assert 'not calibrated' in launched.log
    assert launched.interrupt() == 0, launched.log


def test_what_is_refused_ends_the_launch(ros2, tmp_path):
    bag = write(tmp_path, 'taxel_array')
    launched = ros2('launch', 'tactile_bringup', 'taxel_array.launch.py', 'source:=bag', f'path:={bag}', 'topic:=/nowhere')
    assert launched.wait(120) == 1 or 'TACTILE_FALLBACK' not in os.environ, "ROS 2's own verb has another code"
    assert launched.log.count("has no images on '/nowhere'; its image topics: ") == 1 and 'Traceback' not in launched.log, launched.log


RATE = 10.0  # Hz


def params(name):
    return f'params:={get_package_share_directory("tactile_bringup")}/params/{name}'


@pytest.fixture
def video(tmp_path):
    """8 x 6 dots at rest; two seconds, the last frame 6 px to the right."""
    path = tmp_path / 'rest.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), RATE, (320, 240))
    image = np.full((240, 320, 3), 170, np.uint8)
    for k in range(48):
        cv2.circle(image, (26 + 38 * (k % 8), 22 + 38 * (k // 8)), 5, (40, 40, 40), -1, cv2.LINE_AA)
    for k in range(20):
        writer.write(cv2.GaussianBlur(np.roll(image, 6 if k == 19 else 0, axis=1), (0, 0), 1.0))
    writer.release()
    return path


def test_a_launch_ends_with_its_recording_and_nothing_of_it_is_lost(ros2, listen, video, tmp_path):
    launched = ros2('launch', 'tactile_bringup', 'dots.launch.py', 'source:=file', f'path:={video}', 'record:=bag', 'rate:=4')
    ear = listen({'/diagnostics': DiagnosticArray})
    assert launched.wait(120) == 0, launched.log
    assert launched.complaints == [] and launched.log.count('the recording is over') == 1, launched.log
    said = {status.message.split(':')[0] for message in ear.heard['/diagnostics'] for status in message.status}
    assert 'ended' in said, said
    with BagReader(tmp_path / 'bag') as bag:
        last = [decode(message.data, message.type_name) for message in bag.messages({'/dots/dots'})][-1]
    assert np.median(last.du) == pytest.approx(6.0, abs=0.5), 'the last frame is recorded'


def messages_of(path, topics):
    """Topic -> [message of that topic in the bag, as bytes]."""
    with BagReader(path) as bag:
        found = {topic: [] for topic in topics}
        for message in bag.messages(set(topics)):
            found[message.topic].append(message.data)
    return found


def test_when_the_right_views_were_exposed_is_recorded_and_played(ros2, tmp_path):
    write_scene(tmp_path / 'none', 'areal_dual_press', 4.0, frames=6)
    names = ['/areal_dual/right/time_reference', '/areal_dual/right/image_raw']
    found = {}
    for played, recorded in (('none', 'once'), ('once', 'twice')):
        launched = ros2('launch', 'tactile_bringup', 'areal_dual.launch.py', 'source:=bag', f'path:={tmp_path / played}', 'rate:=0',
                        f'record:={tmp_path / recorded}')
        assert launched.wait(120) == 0, launched.log
        found[recorded] = messages_of(tmp_path / recorded, names)
    assert found['once'] == found['twice']
    times = [decode(data, 'sensor_msgs/msg/TimeReference').time_ref for data in found['once'][names[0]]]
    assert len(times) == 6 and times == [decode(data, 'sensor_msgs/msg/Image').header.stamp for data in found['once'][names[1]]]


def test_without_camera_info_process_bag_writes_the_dots_that_the_live_nodes_publish(ros2, tmp_path):
    write_scene(tmp_path / 'whole', 'disc_twist', 10.0, frames=8)
    with BagReader(tmp_path / 'whole') as bag, BagWriter(tmp_path / 'bag') as blind:
        for raw in bag.messages(set(bag.topics) - {'/touchpad/camera_info'}):
            blind.write(raw.topic, raw.type_name, raw.stamp_ns, raw.data)
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'source:=bag', f'path:={tmp_path / "bag"}', 'rate:=0',
                    'record:=live')
    assert launched.wait(120) == 0, launched.log
    replay = Replay(tmp_path / 'bag', Path(share('params', 'touchpad_sim.yaml')))
    process_bag(replay, tmp_path / 'offline')
    names = ['/touchpad/dots', '/touchpad/contacts', '/touchpad/ground_truth/tip', '/touchpad/ground_truth/wrench']
    offline, live = (messages_of(tmp_path / name, names) for name in ('offline', 'live'))
    assert offline == live
    assert [len(offline[name]) for name in names] == [8, 0, 8, 8], 'contacts need the camera'
    assert any('no usable camera_info' in line for line in replay.left_out.lines())


DRIVERS = {
    'one camera': (CameraNode, lambda path: write_scene(path, 'areal_single_press', 3.0, frames=9, namespace='pad'),
                   {'topic': 'image_raw', 'rate': 30.0}),
    'two cameras': (DualCameraNode, lambda path: write_scene(path, 'areal_dual_press', 3.0, frames=9, namespace='pad'),
                    {'topic': '/pad/left/image_raw', 'right_topic': '/pad/right/image_raw', 'rate': 30.0}),
    'finger': (PsdNode, lambda path: write_psd_scene(path, 'taps', 1000.0, namespace='pad'), {'topic': 'voltages'})}


@pytest.fixture
def play():
    """play(kind, heard, **parameters): a driver that plays a bag, somebody who hears its truth in heard, and a function that waits."""
    rclpy.init()
    executor = SingleThreadedExecutor()

    def begin(kind, heard, **parameters):
        driver = kind(Host(['-r', '__ns:=/finger/tip'], {'source': 'bag', 'frame_id': 'tip', **parameters}))
        listener = rclpy.create_node('listener')
        listener.create_subscription(Contacts, '/finger/tip/ground_truth/contacts', heard.append, QoSProfile(depth=1000))
        executor.add_node(driver), executor.add_node(listener)
        return driver, listener, lambda condition: until(condition, executor)
    yield begin
    nodes = executor.get_nodes()
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown()


def recorded(path):
    """Stamps and numbers of contacts on ground_truth/contacts."""
    with BagReader(path) as bag:
        return [summary(decode(raw.data, raw.type_name)) for raw in bag.messages({'/pad/ground_truth/contacts'})]


def summary(message):
    return message.header.stamp.sec, message.header.stamp.nanosec, len(message.contacts)


@pytest.mark.parametrize('name', DRIVERS)
def test_the_truth_of_a_recording_is_played_as_recorded(play, tmp_path, name):
    kind, write, parameters = DRIVERS[name]
    write(tmp_path / 'bag')
    wanted, heard = recorded(tmp_path / 'bag'), []
    *_, wait = play(kind, heard, path=str(tmp_path / 'bag'), **parameters)
    assert wait(lambda: len(heard) >= len(wanted)), (len(heard), len(wanted))
    assert [summary(message) for message in heard] == wanted and {message.header.frame_id for message in heard} == {'tip'}
    assert any(count for *_, count in wanted)


def test_where_a_recording_has_none_none_is_offered(play, tmp_path):
    write_scene(tmp_path / 'bag', 'areal_single_press', 10.0, frames=3, namespace='pad')
    with BagReader(tmp_path / 'bag') as bag, BagWriter(tmp_path / 'plain') as plain:
        for raw in bag.messages({'/pad/image_raw', '/pad/camera_info'}):
            plain.write(raw.topic, raw.type_name, raw.stamp_ns, raw.data)
    driver, listener, wait = play(CameraNode, [], path=str(tmp_path / 'plain'), topic='image_raw')
    reported = []
    listener.create_subscription(String, '/finger/tip/description', reported.append, LATCHED_QOS)
    assert wait(lambda: reported)
    offered = driver.get_publisher_names_and_types_by_node(driver.get_name(), '/finger/tip')
    assert not any('ground_truth' in topic for topic, _ in offered)

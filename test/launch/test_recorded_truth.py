# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A driver plays the ground truth of a recording, and offers none where a recording has none."""
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from tactile_bringup.simulate.bags import write_psd_scene, write_scene
from tactile_driver.nodes.camera_node import CameraNode
from tactile_driver.nodes.dual_camera_node import DualCameraNode
from tactile_driver.nodes.psd_node import PsdNode
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_msgs.msg import Contacts
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.recordings.writer import BagWriter
from waiting import until

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

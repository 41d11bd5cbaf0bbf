# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A driver plays the ground truth of a recording, and offers none where a recording has none."""
import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS is not sourced')

from rclpy.context import Context  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from tactile_bringup.simulate.bags import write_psd_scene, write_scene  # noqa: E402
from tactile_driver.nodes.camera_node import CameraNode  # noqa: E402
from tactile_driver.nodes.dual_camera_node import DualCameraNode  # noqa: E402
from tactile_driver.nodes.psd_node import PsdNode  # noqa: E402
from tactile_driver.nodes.runtime.host import Host  # noqa: E402
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS  # noqa: E402
from tactile_msgs.msg import Contacts  # noqa: E402
from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_driver.recordings.writer import BagWriter  # noqa: E402
from waiting import until  # noqa: E402

pytestmark = pytest.mark.ros
DRIVERS = {
    'one camera': (CameraNode, lambda path: write_scene(path, 'areal_single_press', 3.0, frames=9, namespace='pad'),
                   {'topic': 'image_raw', 'rate': 30.0}),
    'two cameras': (DualCameraNode, lambda path: write_scene(path, 'areal_dual_press', 3.0, frames=9, namespace='pad'),
                    {'topic': '/pad/left/image_raw', 'right_topic': '/pad/right/image_raw', 'rate': 30.0}),
    'finger': (PsdNode, lambda path: write_psd_scene(path, 'taps', 1000.0, namespace='pad'), {'topic': 'voltages'})}


class Played:
    """A driver that plays a bag, and somebody who hears its ground truth."""

    def __init__(self, kind, **parameters):
        self.context = Context()
        rclpy.init(context=self.context)
        host = Host(['-r', '__ns:=/finger/tip'], {'source': 'bag', 'frame_id': 'tip', **parameters})
        host.options['context'] = self.context
        self.driver, self.heard = kind(host), []
        self.listener = rclpy.create_node('listener', context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        for node in (self.driver, self.listener):
            self.executor.add_node(node)
        self.listener.create_subscription(Contacts, '/finger/tip/ground_truth/contacts', self.heard.append, QoSProfile(depth=1000))

    def until(self, condition):
        return until(condition, self.executor)

    def offered(self):
        names = self.driver.get_publisher_names_and_types_by_node(self.driver.get_name(), '/finger/tip')
        return {topic.removeprefix('/finger/tip/') for topic, _ in names if 'ground_truth' in topic}

    def close(self):
        self.executor.shutdown()
        self.driver.destroy_node()
        self.listener.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def play():
    """Starts to play; ends it after the test."""
    started = []

    def begin(kind, **parameters):
        started.append(Played(kind, **parameters))
        return started[-1]
    yield begin
    for each in started:
        each.close()


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
    wanted = recorded(tmp_path / 'bag')
    played = play(kind, path=str(tmp_path / 'bag'), **parameters)
    assert played.until(lambda: len(played.heard) >= len(wanted)), (len(played.heard), len(wanted))
    assert [summary(message) for message in played.heard] == wanted and {message.header.frame_id for message in played.heard} == {'tip'}
    assert any(count for *_, count in wanted)


def test_where_a_recording_has_none_none_is_offered(play, tmp_path):
    write_scene(tmp_path / 'bag', 'areal_single_press', 10.0, frames=3, namespace='pad')
    with BagReader(tmp_path / 'bag') as bag, BagWriter(tmp_path / 'plain') as plain:
        for raw in bag.messages({'/pad/image_raw', '/pad/camera_info'}):
            plain.write(raw.topic, raw.type_name, raw.stamp_ns, raw.data)
    played = play(CameraNode, path=str(tmp_path / 'plain'), topic='image_raw')
    reported = []
    played.listener.create_subscription(String, '/finger/tip/description', reported.append, LATCHED_QOS)
    assert played.until(lambda: reported)
    assert played.offered() == set()

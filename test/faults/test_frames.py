# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The frames that the headers of all topics of all sensors name: images that of their camera, everything else the sensor's."""
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from fault_rig import Runner  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from rosidl_runtime_py.utilities import get_message  # noqa: E402
from sensor_nodes import made, planned  # noqa: E402
from tactile_perception.sensors import SENSOR_TYPES  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

pytestmark = pytest.mark.ros
OPTICAL = {'': '_camera_optical', 'left/': '_left_camera_optical', 'right/': '_right_camera_optical'}
#: Topics with images, or that belong to one, of a sensor with cameras.
PICTURES = ('image_raw', 'camera_info', 'image_annotated', 'time_reference')
WITHOUT_HEADER = ('description', 'transition_event')
BY_CAMERA = ('camera_node', 'dual_camera_node')


def frame_of(message):
    """The frame that a message names; of markers that of the first."""
    return message.header.frame_id if hasattr(message, 'header') else message.markers[0].header.frame_id


def frames_told(bench, nodes, space):
    """Topic, relative to the namespace -> frames named on it, of all topics of the nodes."""
    found = {}
    for node in nodes:
        for topic, kinds in node.get_publisher_names_and_types_by_node(node.get_name(), node.get_namespace()):
            name = topic.removeprefix(f'/{space}/')
            if name != topic and not name.endswith(WITHOUT_HEADER):
                frames = found.setdefault(name, set())
                bench.ear.node.create_subscription(
                    get_message(kinds[0]), topic, lambda message, frames=frames: frames.add(frame_of(message)), 10)
    bench.until(lambda: all(found.values()), 120.0)
    return found


@pytest.mark.parametrize('sensor_type', SENSOR_TYPES)
def test_headers_name_the_frame_that_their_data_are_in(bench, sensor_type):
    space, places = bench.fresh('framed').strip('/'), []
    plan = planned(sensor_type, space)
    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    bench.ear.node.create_subscription(TFMessage, '/tf_static', places.append, latched)
    nodes = [made(plan, name) for name in plan.nodes]
    runners = [Runner(node) for node in nodes]
    try:
        nodes[0].trigger_configure()
        nodes[0].trigger_activate()
        told = frames_told(bench, nodes, space)
    finally:
        for runner in runners:
            runner.end()
    frame, by_camera = space.replace('/', '_'), SENSOR_TYPES[sensor_type].driver in BY_CAMERA
    wanted = {}
    for topic in told:
        view, _, name = topic.rpartition('/')
        view = f'{view}/' if view in ('left', 'right') and name != 'time_reference' else ''
        wanted[topic] = {frame + OPTICAL[view] if by_camera and name in PICTURES else frame}
    assert told == wanted
    links = {link.child_frame_id: link.header.frame_id for message in places for link in message.transforms}
    optical = {name for names in wanted.values() for name in names} - {frame}
    assert optical <= links.keys() and {links[name] for name in optical} <= {frame}

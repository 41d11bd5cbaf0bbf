# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""touchpad.launch.py with a simulated sensor: results, stamps, frames, rate and shutdown."""
import pathlib

import numpy as np
import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from geometry_msgs.msg import WrenchStamped  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image, PointCloud2  # noqa: E402
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

pytestmark = pytest.mark.ros
RAW = {'image_raw': Image, 'camera_info': CameraInfo}
RESULTS = {'dots': DotTracks, 'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped,
           'points': PointCloud2}
DRAWN = {'markers': MarkerArray, 'image_annotated': Image}
TRUTH = {'ground_truth/contact_region': ContactRegion, 'ground_truth/contacts': Contacts}
RVIZ_TYPES = {'rviz_default_plugins/Image': 'sensor_msgs/msg/Image', 'rviz_default_plugins/Camera': 'sensor_msgs/msg/Image',
              'rviz_default_plugins/MarkerArray': 'visualization_msgs/msg/MarkerArray',
              'rviz_default_plugins/PointCloud2': 'sensor_msgs/msg/PointCloud2'}


def in_namespace(namespace, topics):
    return {f'/{namespace}/{topic}': kind for topic, kind in topics.items()}


def frame_of(message):
    return message.header.frame_id if hasattr(message, 'header') else message.markers[0].header.frame_id


@pytest.fixture
def pressed(ros2, listen):
    """A launch in the namespace left/pad, and a listener that has heard all of a press."""
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'namespace:=left/pad', 'scene:=sphere_press', 'rate:=10')
    ear = listen(in_namespace('left/pad', {**RAW, **RESULTS, **DRAWN, **TRUTH}))
    touched = ear.heard['/left/pad/contacts']
    assert ear.wait_for(lambda: any(message.contacts for message in list(touched)), 40), launched.log
    last = [ear.heard['/left/pad/contact_region'], ear.heard['/left/pad/image_annotated']]
    assert ear.wait_for(lambda: min(map(len, last)) > 40 and all(ear.heard.values()), 60), launched.log
    return launched, ear


def check_graph(ear):
    """What RViz is set up to show is there, as the type that its displays take."""
    graph = {name: types[0] for name, types in ear.node.get_topic_names_and_types()}
    file = pathlib.Path(get_package_share_directory('tactile_bringup')) / 'rviz' / 'touchpad.rviz'
    shown = yaml.safe_load(file.read_text())['Visualization Manager']
    found = {d['Topic']['Value']: RVIZ_TYPES[d['Class']] for d in shown['Displays'] if 'Topic' in d}
    assert set(found) == {'/touchpad/markers', '/touchpad/points', '/touchpad/image_annotated', '/touchpad/image_raw'}
    assert {topic: graph[topic.replace('/touchpad/', '/left/pad/')] for topic in found} == found
    assert graph['/tf_static'] == 'tf2_msgs/msg/TFMessage'
    assert shown['Global Options']['Fixed Frame'] == 'touchpad'


def test_all_topics_with_one_stamp_their_frames_and_the_rate_asked_for(pressed):
    launched, ear = pressed
    for topic, messages in ear.heard.items():
        assert messages, f'nothing on {topic}: {launched.log}'
        frame = 'left_pad_camera_optical' if topic.endswith(('image_raw', 'camera_info', 'image_annotated')) else 'left_pad'
        assert {frame_of(message) for message in list(messages) if getattr(message, 'markers', True)} == {frame}, topic
    images = ear.stamps('/left/pad/camera_info')
    for topic in {**RESULTS, **DRAWN}:
        stamps = ear.stamps(f'/left/pad/{topic}')
        assert stamps == sorted(set(stamps)), topic
        # excludes messages from before the discovery of camera_info, which is best effort
        assert len({s for s in stamps if s >= images[0]} - set(images)) <= 2, topic
    steps = np.diff(ear.stamps('/left/pad/contact_region')) * 1e-9
    assert np.median(steps) == pytest.approx(1 / 10, abs=5e-3)
    check_graph(ear)
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []


def test_without_a_subscriber_nothing_is_computed(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'scene:=rest')
    from diagnostic_msgs.msg import DiagnosticArray
    ear = listen({'/diagnostics': DiagnosticArray})

    def idle():
        said = {status.name: status.message for message in list(ear.heard['/diagnostics']) for status in message.status}
        return sum('idle' in text for text in said.values())
    assert ear.wait_for(lambda: idle() == 3, 30), launched.log
    assert ear.node.count_subscribers('/touchpad/image_raw') == 0
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []


@pytest.mark.parametrize('words, told', [
    (('source:=foo',), 'source:=foo'), (('source:=file',), 'path:='),
    (('source:=bag', 'path:=nowhere'), 'path:=nowhere'), (('params:=nowhere.yaml',), 'params:=nowhere.yaml'),
    (('rate:=fast',), 'rate:=fast'), (('params:=broken.yaml',), 'broken.yaml')])
def test_a_wrong_argument_is_told_in_one_line(ros2, tmp_path, words, told):
    (tmp_path / 'broken.yaml').write_text('a: [1\n')
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', *words)
    assert launched.wait(30) != 0
    assert told in launched.log
    assert len(launched.log.splitlines()) == 3, launched.log  # two are launch's own, about its log file
    assert 'process started' not in launched.log and 'Traceback' not in launched.log


def test_arguments_are_shown(ros2):
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', '--show-args')
    assert launched.wait(30) == 0
    for name in ('namespace', 'source', 'device', 'path', 'params', 'calibration', 'rviz', 'record', 'rate', 'loop', 'scene'):
        assert f"'{name}':" in launched.log

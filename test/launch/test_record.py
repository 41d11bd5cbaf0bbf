# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""record:= writes all topics; source:=bag and process_bag reproduce the results from the recording."""
from collections import Counter

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_msgs.msg import ContactRegion, DotTracks  # noqa: E402

pytestmark = pytest.mark.ros
RESULTS = ('dots', 'contact_region', 'contacts', 'slip', 'wrench')


def counts_of(path):
    with BagReader(path) as bag:
        return Counter(message.topic.removeprefix('/touchpad/') for message in bag.messages())


def stamps_of(path, topic):
    found = []
    with BagReader(path) as bag:
        for message in bag.messages({f'/touchpad/{topic}'}):
            stamp = decode(message.data, message.type_name).header.stamp
            found.append(stamp.sec * 1_000_000_000 + stamp.nanosec)
    return found


@pytest.fixture
def recorded(ros2, listen, tmp_path):
    """A bag of some seconds of a simulated touchpad."""
    launched = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'rate:=10', 'record:=bag')
    ear = listen({'/touchpad/contact_region': ContactRegion})
    assert ear.wait_for(lambda: len(ear.heard['/touchpad/contact_region']) > 60, 60), launched.log
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []
    ear.close()
    return tmp_path / 'bag'


def test_what_is_recorded_can_be_played_and_processed(recorded, ros2, listen, tmp_path):
    counts = counts_of(recorded)
    assert counts['image_raw'] >= 50 and counts['description'] >= 1
    assert counts['camera_info'] - counts['image_raw'] in range(-2, 4)
    assert counts['ground_truth/contact_region'] >= 25
    for topic in RESULTS:
        assert counts[topic] >= 25, counts  # discovery of a writer by the recorder may take three seconds
    images = stamps_of(recorded, 'image_raw')

    played = ros2('launch', 'tactile_bringup', 'touchpad.launch.py', 'source:=bag', 'path:=bag', 'rate:=8')
    ear = listen({'/touchpad/dots': DotTracks, '/touchpad/contact_region': ContactRegion})
    assert played.wait(90) == 0, played.log
    for topic in ear.heard:
        assert set(ear.stamps(topic)) <= set(images) and len(ear.stamps(topic)) > 0.3 * len(images), topic
    assert played.complaints == []

    params = f'{get_package_share_directory("tactile_bringup")}/params/touchpad.yaml'
    processed = ros2('run', 'tactile_perception', 'process_bag', 'bag', 'processed', '--params', params)
    assert processed.wait(120) == 0, processed.log
    again = counts_of(tmp_path / 'processed')
    for topic in RESULTS:
        assert again[topic] >= counts['image_raw'] - 2, (again, processed.log)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Compressed images stand in for raw ones that were not recorded, and only for those."""
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.writer import write_messages


def topics_of(path, **messages):
    """Topics of a bag with these, as read; their counts; topic and type of its messages."""
    write_messages(path, 'pad', [(10**9 + k, name.replace('__', '/'), message) for k, (name, message) in enumerate(messages.items())])
    with BagReader(path) as reader:
        names = dict(reader.topics)
        assert {topic: reader.count({topic}) for topic in names} == dict.fromkeys(names, 1)
        assert [raw.topic for raw in reader.messages({'/pad/image_raw'})] == ['/pad/image_raw'] * ('/pad/image_raw' in names)
        assert sorted((raw.topic, raw.type_name) for raw in reader.messages()) == sorted(names.items())
    return names


def test_a_bag_without_raw_images(tmp_path):
    found = topics_of(tmp_path / 'bag', image_raw__compressed=CompressedImage(), description=String())
    assert found == {'/pad/image_raw': 'sensor_msgs/msg/CompressedImage', '/pad/description': 'std_msgs/msg/String'}


def test_a_bag_with_both(tmp_path):
    found = topics_of(tmp_path / 'bag', image_raw__compressed=CompressedImage(), image_raw=Image())
    assert found == {'/pad/image_raw': 'sensor_msgs/msg/Image', '/pad/image_raw/compressed': 'sensor_msgs/msg/CompressedImage'}


def test_other_types_of_such_a_name_stay(tmp_path):
    assert topics_of(tmp_path / 'bag', words__compressed=String()) == {'/pad/words/compressed': 'std_msgs/msg/String'}

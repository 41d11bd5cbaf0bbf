# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.bags.stamped import TRUTH, find_prefix, pairs_of
from tactile_perception.errors import BadCalibration, BadRecording

pytestmark = pytest.mark.ros


def test_each_image_comes_with_what_is_known_of_it(pressed_bag):
    infos = []
    found = list(pairs_of(pressed_bag, '', ('image_raw', TRUTH), infos.append))
    assert len(found) == len(infos) == 14
    for name, pair in found:
        assert pair['image_raw'].header.stamp == pair[TRUTH].header.stamp
        assert name.startswith('disc at ')
    assert [len(pair[TRUTH].contacts) for _, pair in found][0] == 0


def test_the_sensor_is_found_or_has_to_be_named():
    image = 'sensor_msgs/msg/Image'
    assert find_prefix({'/a/image_raw': image, '/a/dots': 'x'}, '') == '/a/'
    assert find_prefix({'/a/image_raw': image, '/b/image_raw': image}, 'b') == '/b/'
    assert find_prefix({'/a/left/image_raw': image, '/a/right/image_raw': image}, '', 'left/image_raw') == '/a/'
    with pytest.raises(BadRecording, match='--namespace'):
        find_prefix({'/a/image_raw': image, '/b/image_raw': image}, '')


def test_a_bag_without_truth_is_refused(pressed_bag, tmp_path):
    with BagReader(pressed_bag) as reader, BagWriter(tmp_path / 'bare') as writer:
        for raw in reader.messages({'/touchpad/image_raw'}):
            writer.write(raw.topic, raw.type_name, raw.stamp_ns, raw.data)
    with pytest.raises(BadCalibration, match='tool'):
        list(pairs_of(tmp_path / 'bare', '', ('image_raw', TRUTH), lambda _info: None))

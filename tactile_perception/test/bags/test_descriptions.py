# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from std_msgs.msg import String  # noqa: E402

from tactile_perception.bags.descriptions import descriptions  # noqa: E402
from tactile_perception.bags.message_bag import write_messages  # noqa: E402
from tactile_perception.errors import BadRecording  # noqa: E402


@pytest.fixture
def bag(tmp_path):
    said = [('thumb/description', 'source: sim'), ('index/description', 'source: device\nserial: A1'), ('thumb/description', '[cut'),
            ('thumb/description', 'only words'), ('thumb/note', 'source: bag')]
    write_messages(tmp_path / 'bag', 'hand', ((k + 1, topic, String(data=text)) for k, (topic, text) in enumerate(said)))
    return tmp_path / 'bag'


def test_of_any_sensor_in_order_without_what_is_none(bag):
    assert list(descriptions(bag)) == [{'source': 'sim'}, {'source': 'device', 'serial': 'A1'}]


def test_of_one_sensor(bag):
    assert list(descriptions(bag, 'hand/index')) == [{'source': 'device', 'serial': 'A1'}]
    assert list(descriptions(bag, 'hand/palm')) == []


def test_a_recording_that_is_none_is_told(tmp_path):
    with pytest.raises(BadRecording):
        list(descriptions(tmp_path / 'nowhere'))

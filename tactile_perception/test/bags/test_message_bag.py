# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from std_msgs.msg import String  # noqa: E402
from tactile_perception.bags.message_bag import write_messages  # noqa: E402
from tactile_perception.bags.rosbag import BagReader  # noqa: E402
from tactile_perception.errors import BadArgument  # noqa: E402
from tactile_perception.nodes.messages.serialization import MessageCodec  # noqa: E402

pytestmark = pytest.mark.ros


def test_messages_are_read_back_under_the_namespace(tmp_path):
    write_messages(tmp_path / 'bag', '/left/pad/', iter([(5, 'said', String(data='a')), (7, 'heard/too', String(data='b'))]))
    codec = MessageCodec()
    with BagReader(tmp_path / 'bag') as reader:
        found = [(raw.stamp_ns, raw.topic, codec.decode(raw.data, raw.type_name).data) for raw in reader.messages()]
    assert found == [(5, '/left/pad/said', 'a'), (7, '/left/pad/heard/too', 'b')]


def test_a_bag_that_exists_is_not_overwritten(tmp_path):
    with pytest.raises(BadArgument, match='exists'):
        write_messages(tmp_path, 'pad', [])

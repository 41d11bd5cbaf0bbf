# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as bytes: back they are the same, and the same message is the same bytes each time."""
import math

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from geometry_msgs.msg import Point32, Polygon  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from tactile_msgs.msg import ContactRegion, DotTracks, Slip  # noqa: E402
from tactile_perception.errors import BadFrame  # noqa: E402
from tactile_perception.nodes.messages.serialization import MessageCodec, type_name_of  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def codec():
    return MessageCodec()


def region():
    message = ContactRegion(dot_id=[1, 2, 3], dot_state=[0, 1, 2], area=1.5e-5, orientation=math.nan,
                            outlines=[Polygon(points=[Point32(x=1.0, y=2.0, z=3.0)])])
    message.header.frame_id, message.header.stamp.sec = 'pad', 7
    return message


def test_back_it_is_the_same(codec):
    name, data = codec.encode(region())
    back = codec.decode(data, name)
    assert name == 'tactile_msgs/msg/ContactRegion' and math.isnan(back.orientation)
    back.orientation = 0.0
    expected = region()
    expected.orientation = 0.0
    assert back == expected


def test_the_same_message_is_the_same_bytes(codec):
    """The middleware leaves padding as it finds it in memory; what goes into a bag must not depend on that."""
    first, kept = codec.encode(region())[1], []
    for k in range(200):
        kept.append(np.random.default_rng(k).bytes(k * 7))
        assert codec.encode(region())[1] == first
    slip = codec.encode(Slip(state=1, x=[1.0], y=[2.0], vx=[0.0], vy=[0.0]))[1]
    assert all(codec.encode(Slip(state=1, x=[1.0], y=[2.0], vx=[0.0], vy=[0.0]))[1] == slip for _ in range(200))


def test_bytes_of_another_type_are_refused(codec):
    with pytest.raises(BadFrame, match='3 bytes are no sensor_msgs/msg/Image'):
        codec.decode(b'abc', 'sensor_msgs/msg/Image')
    with pytest.raises(BadFrame, match='no_such'):
        codec.decode(b'abc', 'no_such_msgs/msg/Thing')


def test_names_and_definitions(codec):
    assert type_name_of(Image) == 'sensor_msgs/msg/Image' and type_name_of(DotTracks) == 'tactile_msgs/msg/DotTracks'
    assert {'tactile_msgs/msg/Contacts', 'tactile_msgs/msg/Slip', 'geometry_msgs/msg/WrenchStamped'} <= set(codec.store.types)

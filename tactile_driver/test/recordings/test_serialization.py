# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages as bytes: back they are the same, and the same message is the same bytes each time."""
import math
import random

import numpy as np
import pytest
from geometry_msgs.msg import Point32, Polygon
from rosidl_parser.definition import AbstractSequence, AbstractString, Array, NamespacedType
from rosidl_runtime_py.utilities import get_message
from sensor_msgs.msg import Image
from tactile_driver.errors import BadFrame
from tactile_driver.recordings.serialization import decode, encode, type_hash, type_name_of, unusable
from tactile_msgs.msg import ContactRegion, DotTracks, Slip


def region():
    message = ContactRegion(dot_id=[1, 2, 3], dot_state=[0, 1, 2], area=1.5e-5, orientation=math.nan,
                            outlines=[Polygon(points=[Point32(x=1.0, y=2.0, z=3.0)])])
    message.header.frame_id, message.header.stamp.sec = 'pad', 7
    return message


def test_back_it_is_the_same():
    name, data = encode(region())
    back = decode(data, name)
    assert name == 'tactile_msgs/msg/ContactRegion' and math.isnan(back.orientation)
    back.orientation = 0.0
    expected = region()
    expected.orientation = 0.0
    assert back == expected


def test_the_same_message_is_the_same_bytes():
    """The middleware leaves padding as it finds it in memory; what goes into a bag must not depend on that."""
    first, kept = encode(region())[1], []
    for k in range(200):
        kept.append(np.random.default_rng(k).bytes(k * 7))
        assert encode(region())[1] == first
    slip = encode(Slip(state=1, x=[1.0], y=[2.0], vx=[0.0], vy=[0.0]))[1]
    assert all(encode(Slip(state=1, x=[1.0], y=[2.0], vx=[0.0], vy=[0.0]))[1] == slip for _ in range(200))


def test_bytes_of_another_type_are_refused():
    with pytest.raises(BadFrame, match='3 bytes are no sensor_msgs/msg/Image'):
        decode(b'abc', 'sensor_msgs/msg/Image')
    with pytest.raises(BadFrame, match='no_such'):
        decode(b'abc', 'no_such_msgs/msg/Thing')


@pytest.mark.parametrize('type_name', [
    'sensor_msgs/msg/CameraInfo', 'sensor_msgs/msg/PointCloud2', 'sensor_msgs/msg/JointState', 'diagnostic_msgs/msg/DiagnosticArray',
    'geometry_msgs/msg/WrenchStamped', 'tf2_msgs/msg/TFMessage', 'visualization_msgs/msg/MarkerArray', 'tactile_msgs/msg/Contacts',
    'tactile_msgs/msg/DotTracks', 'tactile_msgs/msg/PsdVoltages'])
def test_any_message_is_the_same_bytes_after_reading(type_name):
    rng = random.Random(type_name)
    for _ in range(30):
        message = filled(get_message(type_name)(), rng)
        data = encode(message)[1]
        kept = [rng.randbytes(k * len(data) // 7) for k in range(8)]  # the memory that the middleware writes to next
        del kept
        assert decode(data, type_name) == message and encode(decode(data, type_name))[1] == data == encode(message)[1]


def filled(message, rng):
    """The message with random content: strings and sequences of any small length."""
    for name, kind in zip(message.get_fields_and_field_types(), message.SLOT_TYPES):
        setattr(message, name, value(kind, getattr(message, name), rng))
    return message


def value(kind, present, rng):
    if isinstance(kind, AbstractSequence):
        return [value(kind.value_type, None, rng) for _ in range(rng.choice((0, 0, 1, 2, 3, 5)))]
    if isinstance(kind, Array):
        return [value(kind.value_type, None, rng) for _ in range(kind.size)]
    if isinstance(kind, NamespacedType):
        return filled(get_message('/'.join(kind.namespaced_name()))(), rng)
    if isinstance(kind, AbstractString):
        return 'x' * rng.randrange(9)
    return {'boolean': bool(rng.randrange(2)), 'float': rng.randrange(99) / 4, 'double': rng.random(),
            'octet': rng.randbytes(1)}.get(kind.typename, rng.randrange(100))


def test_names_and_hashes():
    assert type_name_of(Image) == 'sensor_msgs/msg/Image' and type_name_of(DotTracks) == 'tactile_msgs/msg/DotTracks'
    # as rosbag2 of Jazzy records it
    assert type_hash('std_msgs/msg/String') == 'RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18'
    assert type_hash('no_msgs/msg/None') == type_hash('std_msgs/msg/None') == ''


def test_types_of_a_recording_are_usable_or_refused_by_name():
    known = type_hash('tactile_msgs/msg/Slip')
    assert unusable('tactile_msgs/msg/Slip', known) == unusable('tactile_msgs/msg/Slip', '') == ''
    assert 'defined otherwise in the recording' in unusable('tactile_msgs/msg/Slip', 'RIHS01_' + 64 * '1')
    assert unusable('no_msgs/msg/None', '') == 'type no_msgs/msg/None is not installed'

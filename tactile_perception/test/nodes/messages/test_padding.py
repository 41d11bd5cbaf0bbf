# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Padding of serialised messages against decoding and encoding anew by the library rosbags, which writes zeros."""
import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue  # noqa: E402
from geometry_msgs.msg import Point32, Polygon, WrenchStamped  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402
from sensor_msgs.msg import CameraInfo, PointCloud2, PointField  # noqa: E402
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip  # noqa: E402
from tactile_perception.nodes.messages.padding import Padding  # noqa: E402
from tactile_perception.nodes.messages.serialization import MessageCodec, type_name_of  # noqa: E402

pytestmark = pytest.mark.ros

STORE = MessageCodec().store


def messages(rng):
    """One of each kind, with numbers of elements and lengths of text drawn from rng: all alignments occur."""
    def floats():
        return rng.normal(size=rng.integers(0, 4)).tolist()

    loops = [Polygon(points=[Point32(x=1.0, y=2.0, z=3.0)] * int(n)) for n in rng.integers(0, 3, rng.integers(0, 3))]
    found = [
        ContactRegion(dot_id=[1] * int(rng.integers(0, 4)), dot_state=[2] * int(rng.integers(0, 9)), outlines=loops, area=2.5),
        Contacts(contacts=[Contact(id=k, flags=3, depth=0.5) for k in range(rng.integers(0, 4))]),
        DotTracks(rows=3, id=[7] * int(rng.integers(0, 4)), u=floats()),
        Slip(state=1, x=floats(), slipping_fraction=0.5),
        WrenchStamped(),
        PointCloud2(fields=[PointField(name='x' * int(n), offset=4, count=1) for n in rng.integers(0, 9, 3)],
                    data=[1] * int(rng.integers(0, 9))),
        CameraInfo(d=floats(), distortion_model='p' * int(rng.integers(0, 9))),
        DiagnosticArray(status=[DiagnosticStatus(name='n', values=[KeyValue(key='k' * int(n), value='')]) for n in rng.integers(0, 9, 2)]),
    ]
    for message in found:
        message.header.frame_id = 'f' * int(rng.integers(0, 9))
    return found


def anew(data, name):
    return bytes(STORE.serialize_cdr(STORE.deserialize_cdr(data, name), name))


@pytest.mark.parametrize('seed', range(30))
def test_every_message_is_as_encoded_anew(seed):
    padding, rng = Padding(STORE.fielddefs), np.random.default_rng(seed)
    for message in messages(rng):
        data, name = serialize_message(message), type_name_of(type(message))
        assert padding.cleared(data, name) == anew(data, name), name


def test_what_stood_in_the_padding_is_gone():
    """Two bytes between the frame and the first number of a wrench."""
    message, name = WrenchStamped(), 'geometry_msgs/msg/WrenchStamped'
    message.header.frame_id = 'a'
    clean = anew(serialize_message(message), name)
    assert clean[16:18] == b'a\0' and len(clean) == 20 + 6 * 8
    assert Padding(STORE.fielddefs).cleared(clean[:18] + b'\xa5\x5a' + clean[20:], name) == clean


def test_an_unknown_type_is_refused():
    with pytest.raises(KeyError, match='no_such'):
        Padding(STORE.fielddefs).cleared(b'\0\1\0\0', 'no_such_msgs/msg/Thing')

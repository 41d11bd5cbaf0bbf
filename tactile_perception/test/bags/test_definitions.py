# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording's definitions are our own, or add to them, or are refused by name."""
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')
from tactile_perception.bags.definitions import known_as  # noqa: E402
from tactile_perception.nodes.messages.serialization import MessageCodec  # noqa: E402


def test_definitions_as_they_are_written_are_known():
    store = MessageCodec().store
    for kind in ('sensor_msgs/msg/Image', 'tactile_msgs/msg/Contacts', 'std_msgs/msg/String'):
        assert known_as(store, kind, store.generate_msgdef(kind, ros_version=2)[0]) == ''
        assert known_as(store, kind, '') == ''


def test_an_unknown_type_is_taken_with_what_it_is_made_of():
    store = MessageCodec().store
    line = '=' * 80
    text = f'std_msgs/Header header\nPart[] parts\n{line}\nMSG: other_msgs/Part\nfloat64 newtons\n{line}\n' \
        'MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n' \
        f'{line}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n'
    assert known_as(store, 'other_msgs/msg/Forces', text) == ''
    assert {'other_msgs/msg/Forces', 'other_msgs/msg/Part'} <= set(store.fielddefs)


@pytest.mark.parametrize('kind, text, reason', [
    ('no_msgs/msg/None', '', 'not known, nor defined'), ('std_msgs/msg/String', 'float64 data', 'defined otherwise in the recording'),
    ('no_msgs/msg/None', 'this is no definition at all !', 'cannot be read')])
def test_what_cannot_be_taken_is_told(kind, text, reason):
    assert reason in known_as(MessageCodec().store, kind, text)

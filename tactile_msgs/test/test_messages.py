# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each message is built, and goes over the wire as it was."""
from pathlib import Path

import pytest

serialization = pytest.importorskip('rclpy.serialization', reason='ROS is not sourced')
msg = pytest.importorskip('tactile_msgs.msg', reason='tactile_msgs is not built')

NAMES = sorted(path.stem for path in (Path(__file__).parents[1] / 'msg').glob('*.msg'))


@pytest.mark.parametrize('name', NAMES)
def test_a_message_goes_over_the_wire_as_it_was(name):
    kind = getattr(msg, name)
    sent = kind()
    for field, made in sent.get_fields_and_field_types().items():
        if made == 'double':
            setattr(sent, field, 0.1)
    assert serialization.deserialize_message(serialization.serialize_message(sent), kind) == sent

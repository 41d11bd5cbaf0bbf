# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from std_msgs.msg import String  # noqa: E402
from tactile_driver.errors import BadArgument  # noqa: E402
from tactile_perception.nodes.serialization import MessageCodec  # noqa: E402
from tactile_perception.offline.bags import BagWriter  # noqa: E402

from tactile_bringup.recorded import bag_of, was_simulated  # noqa: E402

pytestmark = pytest.mark.ros


def write(path, **sources):
    """A bag with the description of each sensor: name -> source."""
    codec = MessageCodec()
    with BagWriter(path, codec.store) as bag:
        for name, source in sources.items():
            kind, data = codec.encode(String(data=f'sensor_type: touchpad\nsource: {source}\n'))
            bag.write(f'/{name}/description', kind, 10**9, data)


def test_one_bag_of_all_or_one_of_each(tmp_path):
    write(tmp_path / 'whole', thumb='sim', index='device')
    write(tmp_path / 'each' / 'thumb', thumb='device')
    assert bag_of(str(tmp_path / 'whole'), 'index') == str(tmp_path / 'whole')
    assert bag_of(str(tmp_path / 'each'), 'thumb') == str(tmp_path / 'each' / 'thumb')
    assert was_simulated(str(tmp_path / 'whole'), 'thumb') and not was_simulated(str(tmp_path / 'whole'), 'index')


def test_what_is_not_there_is_told(tmp_path):
    write(tmp_path / 'whole', thumb='sim')
    with pytest.raises(BadArgument, match='has no topic under /palm; it has /thumb/description'):
        bag_of(str(tmp_path / 'whole'), 'palm')
    with pytest.raises(BadArgument, match='no such file'):
        bag_of(str(tmp_path / 'nowhere'), 'palm')

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each launch file alone: it starts, publishes its first result, and exits with 0 after Ctrl-C."""
import pathlib

import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from tactile_bringup.sensor_types import SENSOR_TYPES  # noqa: E402
from tactile_msgs.msg import Contacts  # noqa: E402

pytestmark = pytest.mark.ros
HAND = {'sensors': [{'name': 'left/pad', 'type': 'taxel_array', 'rate': 50}, {'name': 'tip', 'type': 'psd_finger', 'rate': 500}]}
#: launch file -> (its arguments, topics whose first message is its result)
LAUNCHES = {**{name: ((), {f'/{name}/contacts': Contacts}) for name in SENSOR_TYPES},
            'hand': (('hand:=hand.yaml',), {'/left/pad/contacts': Contacts, '/tip/contacts': Contacts}),
            'demo': (('out:=pictures', 'rate:=10'), {'/touchpad/contacts': Contacts}),
            'grip_reflex': ((), {'/taxel_array/grip_command': JointState})}


def test_no_launch_file_is_left_out():
    folder = pathlib.Path(get_package_share_directory('tactile_bringup')) / 'launch'
    assert {path.name for path in folder.glob('*.py')} == {f'{name}.launch.py' for name in LAUNCHES}


@pytest.mark.parametrize('name', LAUNCHES)
def test_a_launch_starts_delivers_and_ends(ros2, listen, tmp_path, name):
    (tmp_path / 'hand.yaml').write_text(yaml.safe_dump(HAND))
    words, topics = LAUNCHES[name]
    launched = ros2('launch', 'tactile_bringup', f'{name}.launch.py', *words)
    ear = listen(topics)
    assert ear.wait_for(lambda: all(ear.heard.values()), 60), launched.log
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == [], launched.log

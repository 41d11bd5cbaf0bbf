# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import json
from types import SimpleNamespace

import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')

from launch.actions import LogInfo, Shutdown  # noqa: E402
from tactile_driver.nodes.run import WRONG  # noqa: E402

from tactile_bringup.hand_processes import PROCESSES, composed, ended  # noqa: E402
from tactile_bringup.sensor_launch import PlannedNode  # noqa: E402

pytestmark = pytest.mark.ros
GROUPS = {'thumb': [PlannedNode('tactile_driver', 'camera_node', 'thumb', 'a.yaml', {'device': '12'}),
                    PlannedNode('tactile_perception', 'dot_tracker_node', 'thumb'), PlannedNode('tactile_bringup', 'record_node', 'thumb')],
          'tip': [PlannedNode('tactile_driver', 'psd_node', 'tip')]}


@pytest.mark.parametrize(('how', 'executables'), [
    ('false', ['camera_node', 'dot_tracker_node', 'psd_node', 'record_node']),
    ('sensor', ['composed_node', 'composed_node', 'record_node']),
    ('true', ['composed_node', 'record_node'])])
def test_who_shares_a_process(how, executables):
    assert [node.node_executable for node in PROCESSES[how][1](GROUPS)] == executables


def test_a_composed_process_is_told_all_of_each_node():
    assert json.loads(composed(GROUPS['thumb'][:2])) == [
        {'node': 'camera_node', 'namespace': '/thumb', 'params_file': 'a.yaml', 'parameters': {'device': '12'}},
        {'node': 'dot_tracker_node', 'namespace': '/thumb', 'params_file': '', 'parameters': {}}]


def test_what_is_wrong_ends_the_launch_and_what_dies_is_started_again():
    running, closing = SimpleNamespace(is_shutdown=False), SimpleNamespace(is_shutdown=True)
    on_exit = ended('thumb')
    assert isinstance(on_exit(SimpleNamespace(returncode=WRONG), running)[0], Shutdown)
    said, = on_exit(SimpleNamespace(returncode=-9), running)
    assert isinstance(said, LogInfo) and said.msg[0].text == 'thumb has ended with -9; it is started again'
    assert on_exit(SimpleNamespace(returncode=0), closing) == []

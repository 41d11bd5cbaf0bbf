# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import json
from types import SimpleNamespace

import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')

from launch.actions import LogInfo, Shutdown  # noqa: E402
from tactile_driver.nodes.run import WRONG  # noqa: E402

import tactile_bringup.hand_processes as hand_processes_module  # noqa: E402
from tactile_bringup.hand_processes import PlannedNode, _on_exit, hand_processes, sensor_processes, told  # noqa: E402

pytestmark = pytest.mark.ros
GROUPS = {'thumb': [PlannedNode('tactile_driver', 'camera_node', 'thumb', 'a.yaml', {'device': '12'}),
                    PlannedNode('tactile_perception', 'dot_tracker_node', 'thumb'), PlannedNode('tactile_bringup', 'record_node', 'thumb')],
          'tip': [PlannedNode('tactile_driver', 'psd_node', 'tip')]}


@pytest.mark.parametrize(('how', 'names'), [
    ('false', ['thumb/camera_node', 'thumb/dot_tracker_node', 'tip/psd_node']), ('sensor', ['thumb', 'tip']), ('true', ['hand'])])
def test_who_shares_a_process(monkeypatch, how, names):
    seen = []
    monkeypatch.setattr(hand_processes_module, 'told', lambda groups: seen.append(groups) or '{}')
    assert [node.node_executable for node in hand_processes(GROUPS, how)] == ['hand_node', 'record_node']
    assert list(seen[0]) == names
    assert [node.executable for nodes in seen[0].values() for node in nodes] == ['camera_node', 'dot_tracker_node', 'psd_node']


def test_the_process_of_the_hand_is_told_all_of_each_node():
    assert json.loads(told({'thumb': GROUPS['thumb'][:2]})) == {'thumb': [
        {'node': 'camera_node', 'namespace': '/thumb', 'params_file': 'a.yaml', 'parameters': {'device': '12'}},
        {'node': 'dot_tracker_node', 'namespace': '/thumb', 'params_file': '', 'parameters': {}}]}


def test_what_is_wrong_ends_the_launch_and_what_dies_is_started_again():
    running, closing = SimpleNamespace(is_shutdown=False), SimpleNamespace(is_shutdown=True)
    assert isinstance(_on_exit(SimpleNamespace(returncode=WRONG), running)[0], Shutdown)
    said, = _on_exit(SimpleNamespace(returncode=-9), running)
    assert isinstance(said, LogInfo) and said.msg[0].text == 'hand_node has ended with -9; it is started again'
    assert _on_exit(SimpleNamespace(returncode=0), closing) == []


def test_a_sensor_is_a_hand_of_one():
    said = LogInfo(msg='not calibrated')
    started = sensor_processes([GROUPS['tip'][0], said], {'namespace': '/left/tip', 'composed': 'true'})
    assert [getattr(action, 'node_executable', action) for action in started] == ['hand_node', said]

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from types import SimpleNamespace

import pytest
import yaml
from tactile_bringup.launch import arguments as module
from tactile_bringup.launch.arguments import LaunchError, SensorPlan, end_if_wrong, hand_frames, processes
from tactile_driver.nodes.runtime.run import WRONG

NODES = {'camera_node': {'device': '1e3', 'rate': 60.0, 'loop': True}, 'dot_tracker_node': {}, 'markers_node': {'frame_id': 'left_pad'}}


@pytest.fixture
def plan(monkeypatch, tmp_path):
    monkeypatch.setattr(module, 'launch_config', SimpleNamespace(log_dir=str(tmp_path)))
    return SensorPlan('left_pad', '/left/pad', 'a.yaml', NODES, 'bag')


@pytest.mark.parametrize(('composed', 'expected'), [(True, [list(NODES), ['record_node']]),
                                                    (False, [[name] for name in (*NODES, 'record_node')])])
def test_who_shares_a_process(processes_of, plan, composed, expected):
    assert processes_of(processes(plan, composed)) == expected


def test_each_node_has_its_own_parameters_with_their_types(plan, tmp_path):
    processes(plan, True)
    page = yaml.safe_load((tmp_path / 'left_pad_parameters.yaml').read_text())
    assert page == {'/left/pad/camera_node': {'ros__parameters': NODES['camera_node']},
                    '/left/pad/markers_node': {'ros__parameters': {'frame_id': 'left_pad'}}}


def test_sensors_are_started_again_and_recorders_are_not(plan):
    def again(node):
        return node._ExecuteLocal__respawn
    sensor, recorder = processes(plan, True)
    assert again(sensor) and not again(recorder) and again(hand_frames('hand.yaml'))


def test_what_is_wrong_ends_the_launch_and_what_dies_does_not():
    running, closing = SimpleNamespace(is_shutdown=False), SimpleNamespace(is_shutdown=True)
    with pytest.raises(LaunchError, match='thumb-1'):
        end_if_wrong(SimpleNamespace(returncode=WRONG, process_name='thumb-1'), running)
    end_if_wrong(SimpleNamespace(returncode=WRONG, process_name='thumb-1'), closing)
    end_if_wrong(SimpleNamespace(returncode=-9, process_name='thumb-1'), running)

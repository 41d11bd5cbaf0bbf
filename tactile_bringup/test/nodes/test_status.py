# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""status: the table of a hand, and the command."""

from dataclasses import replace

import pytest
from rclpy.node import Node
from waiting import until

from tactile_bringup.nodes import status
from tactile_bringup.nodes.status import ERROR, OK, WARN, HandStatus, main
from tactile_driver.nodes.runtime import diagnostics
from tactile_driver.nodes.runtime.diagnostics import Health, NodeDiagnostics, common_values

GOOD = {'state': 'running', 'rate (Hz)': '29.97', 'latency (ms)': '12.34', 'age (s)': '0.0213', 'dropped': '2', 'lost frames': '7'}


def line_of(text, node):
    return next(line.split() for line in text.splitlines() if f' {node} ' in line)


def test_a_line_for_each_node_with_its_numbers():
    shown = HandStatus()
    shown.add('/left/thumb/camera_node: camera', OK, '30 Hz', GOOD, 10.0)
    shown.add('/left/thumb/dot_tracker_node: dot_tracker', OK, '', {**GOOD, 'state': 'idle', 'dropped': '0'}, 10.0)
    text = shown.text(10.5)
    assert line_of(text, 'camera_node') == ['left/thumb', 'camera_node', 'running', '30.0', '12.3', '0.02', '2', '7', 'ok']
    assert line_of(text, 'dot_tracker_node') == ['left/thumb', 'dot_tracker_node', 'idle', '-', '-', '-', '0', '7', 'ok']
    shown.add('/hand_node: hand', OK, '', {}, 10.0)
    assert line_of(shown.text(10.5), 'hand_node')[0] == '-' and shown.faulty(10.5) == 0


def test_a_fault_is_reported_and_remembered_when_it_is_over():
    shown = HandStatus()
    shown.add('/thumb/camera_node: camera', ERROR, 'no frame; check the cable', GOOD, 10.0)
    assert shown.faulty(10.0) == 1 and 'thumb/camera_node: no frame; check the cable' in shown.text(10.0)
    shown.add('/thumb/camera_node: camera', WARN, 'slow', GOOD, 11.0)
    assert shown.faulty(11.0) == 0 and 'thumb/camera_node: slow' in shown.text(11.0)
    shown.add('/thumb/camera_node: camera', OK, '30 Hz', GOOD, 12.0)
    assert 'thumb/camera_node: 2 s ago: slow' in shown.text(13.0)


def test_a_node_that_reports_no_more_is_silent():
    shown = HandStatus()
    shown.add('/thumb/camera_node: camera', OK, '30 Hz', GOOD, 10.0)
    assert shown.faulty(13.0) == 0 and shown.faulty(14.0) == 1
    assert line_of(shown.text(20.0), 'camera_node')[-1] == 'SILENT' and 'silent for 10 s; has its process ended?' in shown.text(20.0)


def test_a_sensor_of_which_nothing_is_heard_is_missing():
    shown = HandStatus(['thumb', 'index'])
    assert shown.faulty(10.0) == 1, 'nothing at all is heard'
    shown.add('/thumb/camera_node: camera', OK, '30 Hz', GOOD, 10.0)
    assert shown.missing == ['index'] and shown.faulty(10.0) == 1
    assert 'has the sensor been launched?' in next(line for line in shown.text(10.0).splitlines() if line.startswith('index'))


@pytest.fixture
def reporter(beside):
    """The health, which can be set, that a camera_node of the sensor thumb reports."""
    health = [Health(diagnostics.OK, '30 Hz', common_values('running', 30.0, 0.01, 3))]

    def camera(context):
        node = Node('camera_node', namespace='/thumb', context=context)
        node.diagnostics = NodeDiagnostics(node, 'camera', 'A1', lambda: health[0])
        return node
    beside(camera)
    return health


@pytest.mark.full
def test_once_for_a_script(reporter, capsys, monkeypatch):
    monkeypatch.setattr(status, 'BRINGUP', replace(status.BRINGUP, complete_s=0.5))
    assert until(lambda: main(['--once']) == 0)
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if ' camera_node ' in line]
    assert rows[-1] == ['thumb', 'camera_node', 'running', '30.0', '-', '0.01', '3', '-', 'ok']
    reporter[0] = Health(diagnostics.ERROR, 'no frame for 3 s; check the cable', common_values('lost'))
    assert until(lambda: main(['--once']) == 1)
    assert 'thumb/camera_node: no frame for 3 s; check the cable' in capsys.readouterr().out


def test_where_nothing_is_heard_it_says_so(capsys, tmp_path):
    assert main(['--once', '--patience', '0.5']) == 1
    assert 'no node reports on /diagnostics' in capsys.readouterr().out
    assert main(['--hand', str(tmp_path / 'none.yaml')]) == 1
    assert 'none.yaml: cannot be read' in capsys.readouterr().err

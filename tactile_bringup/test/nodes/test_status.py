# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The command status, beside a node that reports."""

import pytest
from rclpy.node import Node
from tactile_bringup.nodes.status import main
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, Health, NodeDiagnostics, common_values


@pytest.fixture
def reporter(beside):
    """The health, which can be set, that a camera_node of the sensor thumb reports."""
    health = [Health(OK, '30 Hz', common_values('running', 30.0, 0.01, 3))]

    def camera(context):
        node = Node('camera_node', namespace='/thumb', context=context)
        node.diagnostics = NodeDiagnostics(node, 'camera', 'A1', lambda: health[0])
        return node
    beside(camera)
    return health


def test_once_for_a_script(reporter, capsys, tmp_path):
    assert main(['--once']) == 0
    row = next(line.split() for line in capsys.readouterr().out.splitlines() if 'camera_node' in line)
    assert row == ['thumb', 'camera_node', 'running', '30.0', '-', '0.01', '3', '-', 'ok']
    reporter[0] = Health(ERROR, 'no frame for 3 s; check the cable', common_values('lost'))
    (tmp_path / 'hand.yaml').write_text('sensors: [{name: thumb, type: touchpad}, {name: index, type: touchpad}]\n')
    assert main(['--once', '--hand', str(tmp_path / 'hand.yaml'), '--patience', '4']) == 1
    said = capsys.readouterr().out
    assert 'thumb/camera_node: no frame for 3 s; check the cable' in said and 'index' in said and 'has the sensor been launched?' in said


def test_where_nothing_is_heard_it_says_so(capsys, tmp_path):
    assert main(['--once', '--patience', '0.5']) == 1
    assert 'no node reports on /diagnostics' in capsys.readouterr().out
    assert main(['--hand', str(tmp_path / 'none.yaml')]) == 1
    assert 'none.yaml: cannot be read' in capsys.readouterr().err

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the actions of a launch file start."""
import pytest


@pytest.fixture
def processes_of():
    """processes_of(found): the nodes of each process, in the order in which they are started."""
    def nodes_of(action):
        words = [word[0].text for word in action.cmd[1:] if hasattr(word[0], 'text')]
        return words[:words.index('--ros-args')] if action.node_executable == 'sensor_nodes' else [action.node_executable]

    def read(found):
        from launch_ros.actions import Node
        return [nodes_of(action) for action in found if isinstance(action, Node)]
    return read

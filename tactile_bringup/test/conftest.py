# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the actions of a launch file start."""
import json

import pytest


def _started(found):
    from launch_ros.actions import Node
    return [action for action in found if isinstance(action, Node)]


@pytest.fixture
def shared():
    """shared(found): name of a process -> its nodes, as hand_node is told."""
    def read(found):
        hand, = (action for action in _started(found) if action.node_executable == 'hand_node')
        text = next(word[0].text for word in hand.cmd if getattr(word[0], 'text', '').startswith('{'))
        return {name: [node['node'] for node in nodes] for name, nodes in json.loads(text).items()}
    return read


@pytest.fixture
def executables(shared):
    """executables(found): the nodes that are started, those of hand_node first."""
    def read(found):
        alone = [action.node_executable for action in _started(found) if action.node_executable != 'hand_node']
        return [node for nodes in shared(found).values() for node in nodes] + alone
    return read

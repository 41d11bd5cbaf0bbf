# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for the tests of nodes, in this process and as processes of their own."""
import signal

import pytest
import rclpy
import watching
from fake_source import video_of
from rclpy.context import Context
from rclpy.lifecycle import LifecycleNode


@pytest.fixture
def start(request):
    """Starts the node that the module names NODE, start(**parameters); ends it at the end, which has to work cleanly."""
    processes = []

    def node(**parameters):
        processes.append(watching.started(request.module.NODE, parameters))
        return processes[-1]
    yield node
    for process in processes:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


@pytest.fixture
def watcher(request):
    """Of the node that the module names NODE."""
    watcher = watching.Watcher(request.module.NODE)
    yield watcher
    watcher.close()


@pytest.fixture
def node():
    """A node in a context of its own."""
    context = Context()
    rclpy.init(context=context)
    made = LifecycleNode('tested', context=context)
    yield made
    made.destroy_node()
    rclpy.try_shutdown(context=context)


@pytest.fixture
def driven():
    """Makes an active driver's node, driven(kind, **parameters), and puts it away at the end."""
    made = []

    def make(kind, **parameters):
        made.append(watching.Driven(kind, **parameters))
        return made[-1]
    yield make
    for each in made:
        each.close()


@pytest.fixture
def video(tmp_path):
    return video_of(tmp_path / 'pad.avi', range(0, 200, 2))

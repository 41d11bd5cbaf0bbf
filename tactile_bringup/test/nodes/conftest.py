# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A node that draws, somebody who looks at it, and the time that both need."""
import threading
from functools import partial

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from waiting import until


@pytest.fixture
def bench():
    """bench(make) -> (other node, until(condition) -> whether it came true)."""
    made = []

    def begin(make):
        rclpy.init()
        made.extend([SingleThreadedExecutor(), make(), rclpy.create_node('other')])
        executor = made[0]
        for node in made[1:]:
            executor.add_node(node)

        return made[2], partial(until, executor=executor)
    yield begin
    if made:
        made[0].shutdown()
    for node in made[1:]:
        node.destroy_node()
    rclpy.try_shutdown()


@pytest.fixture
def beside():
    """beside(make): the node make(context), spun in a thread beside the test."""
    made = []

    def begin(make):
        context = Context()
        rclpy.init(context=context)
        node, executor = make(context), SingleThreadedExecutor(context=context)
        executor.add_node(node)
        thread = threading.Thread(target=executor.spin, daemon=True)
        thread.start()
        made.append((node, executor, thread, context))
        return node
    yield begin
    for node, executor, thread, context in made:
        executor.shutdown()
        thread.join(5)
        node.destroy_node()
        rclpy.shutdown(context=context)

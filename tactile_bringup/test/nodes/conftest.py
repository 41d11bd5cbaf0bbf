# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A node that draws, somebody who looks at it, and the time that both need."""
import time

import pytest


@pytest.fixture
def bench():
    """bench(make, domain) -> (other node, until(condition, seconds) -> whether it came true)."""
    rclpy = pytest.importorskip('rclpy')
    from rclpy.executors import SingleThreadedExecutor
    made = []

    def begin(make, domain):
        rclpy.init(domain_id=domain)
        made.extend([SingleThreadedExecutor(), make(), rclpy.create_node('other')])
        executor = made[0]
        for node in made[1:]:
            executor.add_node(node)

        def until(condition, seconds=15.0):
            end = time.monotonic() + seconds
            while not condition() and time.monotonic() < end:
                executor.spin_once(timeout_sec=0.05)
            return condition()
        return made[2], until
    yield begin
    if made:
        made[0].shutdown()
    for node in made[1:]:
        node.destroy_node()
    rclpy.try_shutdown()

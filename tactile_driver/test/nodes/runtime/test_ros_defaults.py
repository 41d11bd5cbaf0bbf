# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

from rclpy.clock import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from tactile_driver.nodes.runtime.ros_defaults import steady_timer


def test_it_runs_where_simulated_time_stands_still(node):
    node.set_parameters([Parameter('use_sim_time', value=True)])
    calls = []
    timer = steady_timer(node, 0.01, lambda: calls.append(time.monotonic()))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    end = time.monotonic() + 5.0
    while len(calls) < 3 and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    assert len(calls) >= 3 and timer.clock.clock_type == ClockType.STEADY_TIME

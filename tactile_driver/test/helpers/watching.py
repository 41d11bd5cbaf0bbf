# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A driver's node as a user runs it, a process of its own, watched over ROS: for the tests of this folder."""
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import rclpy
from ament_index_python.packages import get_package_prefix
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import GetState
from rcl_interfaces.msg import Parameter as ParameterMessage, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from waiting import until

from tactile_driver.nodes.runtime.diagnostics import NodeDiagnostics
from tactile_driver.nodes.runtime.host import Host

ERROR = b'\x02'


class Watcher:
    """A node that collects messages and calls the services of the driver of this name."""

    def __init__(self, name):
        self.name = name
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node('watcher', context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def collect(self, kind, topic, qos=100):
        messages = []
        self.node.create_subscription(kind, topic, messages.append, qos)
        return messages

    def until(self, condition):
        assert until(condition, self.executor)

    def spin(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def call(self, kind, name, request):
        """The middleware announces clients in their order: a server that answers state() knows this one, and its answer is not lost."""
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(timeout_sec=60.0)
        self.state()
        future = client.call_async(request)
        self.until(future.done)
        return future.result()

    def state(self):
        """Asked again every 3 s: the middleware may lose the answer to a client that the server has only just met."""
        client = self.node.create_client(GetState, f'/{self.name}/get_state')
        assert client.wait_for_service(timeout_sec=60.0)
        for _ in range(20):
            future = client.call_async(GetState.Request())
            self.executor.spin_until_future_complete(future, timeout_sec=3.0)
            if future.done():
                return future.result().current_state.label
        raise AssertionError(f'/{self.name}/get_state does not answer')

    def put(self, name, text):
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=text)
        request = SetParameters.Request(parameters=[ParameterMessage(name=name, value=value)])
        return self.call(SetParameters, f'/{self.name}/set_parameters', request).results[0]

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


class Driven:
    """An active driver's node of this kind in this process, and what is received of it; parameters: of the node, by name."""

    def __init__(self, kind, **parameters):
        rclpy.init()
        NodeDiagnostics.period_s, self._period = 0.05, NodeDiagnostics.period_s
        self.node = kind(Host(['-r', '__ns:=/driven'], {'autostart': False, **parameters}))  # not that of the processes
        self.node.trigger_configure()
        self.node.trigger_activate()
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)

    def collect(self, topic, kind):
        """The messages on a topic, as they come."""
        messages = []
        self.node.create_subscription(kind, topic, messages.append, qos_profile_sensor_data)
        return messages

    def received(self, *topics):
        """The first message on each topic (name, kind)."""
        found = [self.collect(*topic) for topic in topics]
        assert until(lambda: all(found), self.executor)
        return [messages[0] for messages in found]

    def reported(self, holds):
        """The first status on /diagnostics for which holds(status)."""
        reports = self.collect('/diagnostics', DiagnosticArray)
        assert until(lambda: any(holds(status) for report in reports for status in report.status), self.executor)
        return next(status for report in reports for status in report.status if holds(status))

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()
        NodeDiagnostics.period_s = self._period


def started(name, parameters):
    """The process of the node of this name with these parameters."""
    arguments = [x for key, value in parameters.items() for x in ('-p', f'{key}:={value}')]
    command = Path(get_package_prefix('tactile_driver'), 'lib', 'tactile_driver', name)
    return subprocess.Popen([command, '--ros-args', *arguments], text=True, stderr=subprocess.PIPE, start_new_session=True)


def ended(process, which=signal.SIGINT):
    """(exit code, what was logged) after a signal."""
    process.send_signal(which)
    log = process.communicate(timeout=60)[1]
    return process.returncode, log


def stamps(messages):
    return np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A driver's node as a user runs it, a process of its own, watched over ROS: for the tests of this folder."""
import signal
import subprocess
import sys
import time

import numpy as np
import rclpy
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from waiting import until

CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE, SHUTDOWN_ACTIVE = 1, 2, 3, 4, 7
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

    def change(self, transition):
        request = ChangeState.Request()
        request.transition.id = transition
        return self.call(ChangeState, f'/{self.name}/change_state', request).success

    def put(self, name, text):
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=text)
        request = SetParameters.Request(parameters=[ParameterMessage(name=name, value=value)])
        return self.call(SetParameters, f'/{self.name}/set_parameters', request).results[0]

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


class Streamed:
    """A stream in this process on an active node, and what is received of it. make: of the node, the stream."""

    def __init__(self, node, make):
        self.node, self.stream = node, make(node)
        node.trigger_configure()
        node.trigger_activate()
        self.executor = SingleThreadedExecutor(context=node.context)
        self.executor.add_node(node)

    def received(self, *topics):
        """The first message on each topic (name, kind) while the stream runs."""
        messages = {name: [] for name, _ in topics}
        for name, kind in topics:
            self.node.create_subscription(kind, name, messages[name].append, qos_profile_sensor_data)
        self.stream.resume()
        assert until(lambda: all(messages.values()), self.executor)
        self.executor.shutdown()
        self.stream.stop()
        return [messages[name][0] for name, _ in topics]


def started(name, parameters):
    """The process of the node of this name with these parameters."""
    arguments = [x for key, value in parameters.items() for x in ('-p', f'{key}:={value}')]
    return subprocess.Popen([sys.executable, '-m', f'tactile_driver.nodes.{name}', '--ros-args', *arguments], text=True,
                            stderr=subprocess.PIPE, start_new_session=True)


def ended(process, which=signal.SIGINT):
    """(exit code, what was logged) after a signal."""
    process.send_signal(which)
    log = process.communicate(timeout=60)[1]
    return process.returncode, log


def stamps(messages):
    return np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages])

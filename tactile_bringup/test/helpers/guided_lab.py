# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A guided session, the simulated stage and who publishes the sensor's messages, in one process."""
import rclpy
from ament_index_python.packages import get_package_share_directory
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger
from waiting import until

from tactile_bringup.nodes.calibrate_node import CalibrateNode
from tactile_bringup.nodes.simulated_stage import BASE, MOUNTING, PROBE, SimulatedStage
from tactile_perception.core.sensor_type import SENSOR_TYPES

SHARE = get_package_share_directory('tactile_bringup')
TIPS = {'touchpad': 0.008, 'air_cushion': 0.030}


class Lab:
    """The session's node, the stage and the sensor's messages, one after the other. ahead: raw messages that may wait to be judged."""

    def __init__(self, sensor_type, output, ahead=5, **more):
        given = {'probe': PROBE, 'base': BASE, 'frame_id': 'palm', 'wrench': '/stage/wrench', 'output': output, 'mounting': list(MOUNTING),
                 'params': f'{SHARE}/params/{sensor_type}_sim.yaml', 'tip_radius': TIPS.get(sensor_type, 0.0),
                 'along_normal': str(sensor_type == 'psd_finger').lower(), **more}
        words = [word for name, value in given.items() if value is not None for word in ('-p', f'{name}:={value}')]
        rclpy.init(args=['--ros-args', '-r', '__ns:=/palm', *words])
        self.session, self.stage, self.driver = CalibrateNode(), SimulatedStage(), rclpy.create_node('driver')
        self._nodes = self.session, self.stage, self.driver
        self._executor = SingleThreadedExecutor()
        for node in self._nodes:
            self._executor.add_node(node)
        self._raw = SENSOR_TYPES[sensor_type].raw['topic']
        self._ahead = ahead
        self._followed = ['ground_truth/contacts'] if sensor_type == 'psd_finger' else ['ground_truth/tip', 'ground_truth/wrench']
        self._publishers = {}

    def until(self, condition):
        assert until(condition, self._executor)

    def call(self, service):
        client = self.driver.create_client(Trigger, f'calibrate_node/{service}')
        answer = client.call_async(Trigger.Request())
        self.until(answer.done)
        return answer.result().message

    def play(self, messages):
        """Publish until the session is complete, some messages ahead of it; yields the number of bags after each."""
        handled = self.session.handled
        for _, topic, message in messages:
            handled += topic == self._raw
            self._publish(topic, message)
            self.until(lambda: self.session.handled > handled - self._ahead or self.session.complete)  # noqa: B023
            if self.session.complete:
                return
            yield len(self.session.presses)
        self.until(lambda: self.session.handled == handled or self.session.complete)

    def _publish(self, topic, message):
        if topic not in self._publishers:
            found = self._publishers[topic] = self.driver.create_publisher(type(message), topic, 100)
            if not topic.startswith('ground_truth/') or topic in self._followed:
                self.until(found.get_subscription_count)
        self._publishers[topic].publish(message)

    def close(self):
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        rclpy.shutdown()

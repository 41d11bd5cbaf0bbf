# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""hand_frames_node: publishes the mounting poses of a hand's sensors on /tf_static."""
from __future__ import annotations

from pathlib import Path

from rclpy.node import Node
from tf2_msgs.msg import TFMessage

from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import static_transform
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import OK, Health, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_driver.nodes.runtime.run import process_of

from ..hand.description import read_hand
from ..parameters.table import HAND_FRAMES_PARAMETERS


class HandFramesNode(Node):
    """Publishes once, latched, in one process; static_transform_publisher of tf2_ros needs a process per sensor."""

    def __init__(self, host: Host | None = None):
        super().__init__('hand_frames_node', **(host or Host()).options)
        settings = NodeParameters(self, HAND_FRAMES_PARAMETERS)
        if settings.problems or not settings['hand']:
            raise BadArgument('hand_frames_node: ' + ('; '.join(settings.problems.values()) or 'parameter hand is empty; name the file'))
        self._hand = read_hand(Path(settings['hand']))
        self._output = self.create_publisher(TFMessage, '/tf_static', LATCHED_QOS)
        self._output.publish(TFMessage(transforms=[
            static_transform(sensor.parent, sensor.frame, sensor.xyz, sensor.quaternion, self.get_clock().now().to_msg())
            for sensor in self._hand.sensors]))
        self._diagnostics = NodeDiagnostics(self, 'frames', self._hand.frame, self._examine)
        guard_services(self)

    def _examine(self) -> Health:
        return Health(OK, f'{len(self._hand.sensors)} sensors on {self._hand.frame}', common_values('running'))


main = process_of(HandFramesNode)

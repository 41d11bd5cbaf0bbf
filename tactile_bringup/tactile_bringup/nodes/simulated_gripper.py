# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""simulated_gripper: grip_command -> image_raw and ground_truth of a taxel array in its finger, gripper_state."""
from __future__ import annotations

import math
import sys

from rclpy.node import Node
from sensor_msgs.msg import Image, JointState
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.nodes.messages.ground_truth import TRUTH, GroundTruth
from tactile_driver.nodes.runtime.run import run_node
from tactile_driver.simulation.taxel.scene import HeldScene

from .grip_reflex import JOINT

_RATE = 100.0  # Hz, of images and of the gripper
_SPEED = 50.0  # N/s, by which the grip force follows its command: a servo of 5 N in 0.1 s


class SimulatedGripper(Node):
    """Two fingers with a taxel array in one, and an object that is put between them, pulled and taken away again and again.

    The object slides or stays as the commanded force has it: the loop is closed.
    """

    def __init__(self):
        super().__init__('simulated_gripper')
        self._scene, self._number, self._command = HeldScene(_RATE), 0, 0.0
        self._images = self.create_publisher(Image, 'image_raw', 100)
        self._truth = GroundTruth(self, TRUTH)
        self._states = self.create_publisher(JointState, 'gripper_state', 10)
        self.create_subscription(JointState, 'grip_command', self._take, 10)
        self.create_timer(1 / _RATE, self._play)

    def _take(self, message: JointState) -> None:
        if len(message.effort) == 1 and 0.0 <= message.effort[0] < float('inf'):
            self._command = message.effort[0]

    def _play(self) -> None:
        """The next frame, and the state: N by which the gripper presses and the object is pulled, m by which it has slid."""
        scene, most = self._scene, _SPEED / _RATE
        scene.grip += min(max(self._command - scene.grip, -most), most)
        values, truth = scene.render(self._number / _RATE)
        self._number += 1
        stamp_ns = self.get_clock().now().nanoseconds
        header = header_of(stamp_ns, self.get_namespace().strip('/') or 'taxel_array')
        self._images.publish(image_to_message(Frame(values, stamp_ns, 'mono8'), '', header))
        self._truth.publish(truth, 1 / _RATE, header)
        self._states.publish(JointState(header=header, name=[JOINT, 'object'], position=[math.nan, scene.slid],
                                        effort=[scene.grip, scene.pull(scene.time)]))


def main(args: list[str] | None = None) -> None:
    """The process simulated_gripper."""
    sys.exit(run_node(SimulatedGripper, args))


if __name__ == '__main__':
    main()

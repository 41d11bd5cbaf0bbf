# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""gripper_follower: the sensors of a gripper that mujoco_ros2_control simulates, by the states that its controllers publish.

It replaces gripper_node: array and touchpad are the same, physics, clock and gripper command are the simulator's.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS, steady_timer
from tactile_driver.nodes.runtime.run import process_of
from tactile_driver.simulation.skin.tools import Pose
from tactile_driver.sources.source import NS

from .constants import GRASP
from .followed_world import JOINTS, LIFT_JOINT, FollowedWorld, GripperState
from .gripper_node import GripperSensors
from .objects import READY, Disturbance, HeldObject

POSE_TOPIC, LIFT_TOPIC = '/object_pose_broadcaster/pose', '/lift_controller/joint_trajectory'


class GripperFollower(GripperSensors):
    """Joint states and pose of one cycle of the controllers have the same stamp, and are one state of the gripper."""

    _starts_now = False

    def _make_world(self, held: HeldObject, disturbances: Sequence[Disturbance]) -> FollowedWorld:
        return FollowedWorld(held, self._settings['pad'])

    def _start_serving(self) -> None:
        self._waiting: dict[int, JointState | PoseStamped] = {}
        self._has_states = False
        self._lift_output = self.create_publisher(JointTrajectory, LIFT_TOPIC, STREAM_QOS)
        self._inputs = [self.create_subscription(JointState, '/joint_states', self._take, QoSProfile(depth=GRASP.waiting_messages)),
                        self.create_subscription(PoseStamped, POSE_TOPIC, self._take, QoSProfile(depth=GRASP.waiting_messages))]
        steady_timer(self, GRASP.held_check_s, self._lift_when_held)
        self.get_logger().info(f'waiting for /joint_states and {POSE_TOPIC} of the controllers')

    def _take(self, message: JointState | PoseStamped) -> None:
        """Combine two messages with the same stamp; two with a step of the clock between them are not used."""
        stamp = stamp_ns_of(message.header)
        other = self._waiting.pop(stamp, message)
        if isinstance(other, type(message)):
            self._waiting[stamp] = message
            while len(self._waiting) > GRASP.waiting_messages:
                self._waiting.pop(next(iter(self._waiting)))
        elif isinstance(message, JointState):
            self._combine(message, other)
        else:
            self._combine(other, message)

    def _combine(self, joints: JointState, pose: PoseStamped) -> None:
        if not set(JOINTS) <= set(joints.name):
            return
        values = dict(zip(joints.name, zip(joints.position, joints.velocity, joints.effort, strict=True), strict=True))
        origin, turn = pose.pose.position, pose.pose.orientation
        held = Pose(np.array([origin.x, origin.y, origin.z]), Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix())
        state = GripperState(stamp_ns_of(joints.header) / NS, {name: values[name] for name in JOINTS}, held)
        if all(np.isfinite([*np.ravel(list(state.joints.values())), *state.held.origin])):
            self._gripper.world.take(state)
            if not self._has_states:
                self._has_states = True
                self.get_logger().info(f'{READY} {self._settings["port"]}')

    def _start_lift(self) -> None:
        """The controller interpolates by a cubic, which ends without velocity, as the wrist of gripper_node rises."""
        lifted = Duration(seconds=GRASP.lift_s).to_msg()
        point = JointTrajectoryPoint(positions=[GRASP.lift_height], velocities=[0.0], time_from_start=lifted)
        self._lift_output.publish(JointTrajectory(joint_names=[LIFT_JOINT], points=[point]))
        super()._start_lift()

    def destroy_node(self) -> None:
        """Wait for no further state."""
        self._gripper.world.end()
        super().destroy_node()


main = process_of(GripperFollower)

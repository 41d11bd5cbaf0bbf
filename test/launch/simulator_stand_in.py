#!/usr/bin/env python3
# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stands for mujoco_ros2_control with its controllers where these are not installed: the same description, parameters, topics and action.

Of their sources it has what grasp.launch.py uses: the MJCF and the interfaces that the tag ros2_control of /robot_description names, the
joint's state from MuJoCo, the pose sensor, the PID of effort_controllers/GripperActionController and the cubic of
JointTrajectoryController. Joint states and pose of a cycle have one stamp, except where the clock ticks between them: here in every
tenth cycle.
"""
import sys
import time
from importlib import import_module
from xml.etree import ElementTree

import numpy as np
import rclpy
import yaml
from control_msgs.action import GripperCommand
from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionServer
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

mujoco = import_module('mujoco')  # an optional extra


class Simulator:
    """Serves the action and the topics from when /robot_description has come."""

    def __init__(self, node, parameters):
        self._node, self._parameters = node, {name: own['ros__parameters'] for name, own in parameters.items()}
        self._goal, self._max_force, self._lift, self.model, self._cycles = None, 0.0, None, None, 0
        self._subscriptions = [
            node.create_subscription(String, '/robot_description', self._start,
                                     QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)),
            node.create_subscription(JointTrajectory, '/lift_controller/joint_trajectory', self._take_lift, 1)]
        self._clock, self._joints, self._pose = (node.create_publisher(kind, topic, 10) for kind, topic in (
            (Clock, '/clock'), (JointState, '/joint_states'), (PoseStamped, '/object_pose_broadcaster/pose')))

    def _start(self, message):
        control = ElementTree.fromstring(message.data).find('ros2_control')
        values = {each.get('name'): each.text for each in control.find('hardware').findall('param')}
        assert control.find('hardware/plugin').text == 'mujoco_ros2_control/MujocoSystemInterface' and values['headless'] == 'true'
        self._states = [joint.get('name') for joint in control.findall('joint')]
        self._commands = {joint.get('name'): joint.find('command_interface').get('name') for joint in control.findall('joint')
                          if joint.find('command_interface') is not None}
        sensor, = control.findall('sensor')
        assert self._parameters['object_pose_broadcaster']['pose_name'] == sensor.get('name')
        self._sensor = next(each.text for each in sensor.findall('param') if each.get('name') == 'mujoco_sensor_name')
        self._speed = float(values['sim_speed_factor'])
        self._period = 1 / self._parameters['controller_manager']['update_rate']
        model = mujoco.MjModel.from_xml_path(values['mujoco_model'])
        self._actuators = {model.joint(model.actuator(number).trnid[0]).name: number for number in range(model.nu)}
        assert self._commands == {'lift_joint': 'position', 'left_finger_joint': 'effort'} and set(self._actuators) == set(self._commands)
        self.data = mujoco.MjData(model)
        self._server = ActionServer(self._node, GripperCommand, '/gripper_controller/gripper_cmd', self._execute)
        self.model = model

    def _execute(self, goal):
        self._goal, self._max_force = goal.request.command.position, goal.request.command.max_effort
        goal.succeed()
        return GripperCommand.Result(stalled=True)

    def _take_lift(self, message):
        point, = message.points
        assert list(message.joint_names) == ['lift_joint'] and list(point.velocities) == [0.0]
        self._lift = self.data.time, point

    def _height(self):
        if self._lift is None:
            return 0.0
        begin, point = self._lift
        share = min((self.data.time - begin) / (point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec), 1.0)
        return point.positions[0] * share * share * (3 - 2 * share)

    def run(self):
        """Steps until the context ends."""
        begin = None
        while rclpy.ok():
            rclpy.spin_once(self._node, timeout_sec=0.0 if self.model else 0.1)
            if self.model is None:
                continue
            begin = begin or time.monotonic()
            self._cycle()
            time.sleep(max(begin + self.data.time / self._speed - time.monotonic(), 0.0))

    def _cycle(self):
        data, own = self.data, self._parameters['gripper_controller']
        if self._goal is not None:
            error = self._goal - data.joint(own['joint']).qpos[0]
            force = own['gains'][own['joint']]['p'] * error
            data.ctrl[self._actuators[own['joint']]] = np.clip(force, -self._max_force, self._max_force)
        data.ctrl[self._actuators['lift_joint']] = self._height()
        end = data.time + self._period
        while data.time < end - 1e-9:
            mujoco.mj_step(self.model, data)
        self._cycles += 1
        is_torn = self._cycles % 10 == 0
        stamp, earlier = (Time(nanoseconds=round(1e9 * (data.time - tick))).to_msg() for tick in (0.0, is_torn * self.model.opt.timestep))
        self._clock.publish(Clock(clock=stamp))
        joints = JointState(name=self._states)
        joints.position = [float(data.joint(name).qpos[0]) for name in self._states]
        joints.velocity = [float(data.joint(name).qvel[0]) for name in self._states]
        joints.effort = [float(data.qfrc_actuator[self.model.joint(name).dofadr[0]]) for name in self._states]
        pose = PoseStamped()
        joints.header.stamp, pose.header.stamp = earlier, stamp
        position, quaternion = (data.sensor(f'{self._sensor}_{part}').data for part in ('pos', 'quat'))
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = map(float, position)
        turn = pose.pose.orientation
        turn.w, turn.x, turn.y, turn.z = map(float, quaternion)
        self._joints.publish(joints)
        self._pose.publish(pose)


def main():
    """Ends with exit code 0 at Ctrl-C."""
    files = [after for before, after in zip(sys.argv, sys.argv[1:], strict=False) if before == '--params-file']
    parameters = next(page for page in (yaml.safe_load(open(file)) for file in files) if 'gripper_controller' in page)
    rclpy.init()
    try:
        Simulator(rclpy.create_node('controller_manager'), parameters).run()
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()

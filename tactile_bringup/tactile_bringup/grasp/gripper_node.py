# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""gripper_node: a parallel gripper in MuJoCo with an object between its fingers.

Its array sends frames over a pseudo-terminal, as the firmware of a real one over USB, so that driver and perception are those of any array.
"""
from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
from control_msgs.action import GripperCommand
from rclpy.action import ActionServer
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from tactile_driver.emulators import PortEmulator
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import OK, WARN, Health, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS, steady_timer
from tactile_driver.nodes.runtime.run import process_of
from tactile_driver.simulation.taxel.pad import Ink

from ..parameters.table import GRIPPER_PARAMETERS
from .objects import READY, SETTLED_S, object_named
from .world import FRAME_S, TAXELS, GraspTruth, GraspWorld

_JOINT_RATE = 50.0  # Hz
_MAX_STANDSTILL = 1e-5  # m per period of the joint states; a gripper that moves less has stalled or has reached its goal
_REACHED = 5e-4  # m from the commanded gap
_DRIVER_ENDS_S = 0.5  # Ctrl-C ends the array's driver at the same moment; it must not report that its port is gone
_LATE_S = 0.5  # behind real time, from which the gripper says so


class SimulatedGripper(PortEmulator):
    """Steps the world in real time, and sends the array's counts. force: N, of each finger, negative opens; set by another thread."""

    def __init__(self, link: Path, world: GraspWorld, seed: int):
        super().__init__(link, 1 / FRAME_S)
        self.world, self.force = world, -1.0
        self.truth: GraspTruth | None = None
        self._ink = Ink((TAXELS, TAXELS), seed, 1 / FRAME_S)
        self._begin_s = time.monotonic()

    @property
    def late_s(self) -> float:
        """How far the engine is behind real time, s."""
        return time.monotonic() - self._begin_s - self.world.time_s

    def _counts(self) -> np.ndarray:
        pressure, self.truth = self.world.advance(self.force)
        return self._ink.read(pressure).astype(np.uint16)


class GripperNode(Node):
    """Serves the action `gripper_cmd` (control_msgs/GripperCommand) and the service `~/lift`, and publishes /joint_states.

    A goal presses with max_effort, N, until the gap between the pads is `position`, m; it is reached, or stalled at the object. A new goal
    replaces the present one. Raises BadArgument for a wrong parameter, an unknown object, or without MuJoCo.
    """

    def __init__(self, host: Host | None = None):
        super().__init__('gripper_node', **(host or Host()).options)
        settings = NodeParameters(self, GRIPPER_PARAMETERS)
        if settings.problems:
            raise BadArgument('gripper_node: ' + '; '.join(settings.problems.values()))
        world = GraspWorld(*object_named(settings['object']))
        self._gripper = SimulatedGripper(Path(settings['port']), world, settings['seed'])
        self._goal: ServerGoalHandle | None = None
        self._position, self._is_still = 0.0, False
        self._lifts, self._held_s = settings['lift'], np.inf
        self._joints = self.create_publisher(JointState, '/joint_states', STREAM_QOS)
        self._server = ActionServer(self, GripperCommand, 'gripper_cmd', self._finish, handle_accepted_callback=self._accept)
        self._service = self.create_service(Trigger, '~/lift', self._lift)
        self._diagnostics = NodeDiagnostics(self, 'gripper', settings['object'], self._examine)
        guard_services(self)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._gripper.run, args=(self._stopped.is_set,), name='engine', daemon=True)
        self._thread.start()
        steady_timer(self, 1 / _JOINT_RATE, self._publish)
        self.get_logger().info(f'{READY} {settings["port"]}')

    @property
    def _gap(self) -> float:
        """Between the pads, m."""
        return 2 * (self._gripper.world.closed_at - self._position)

    def _accept(self, goal: ServerGoalHandle) -> None:
        before, self._goal = self._goal, goal
        if before is not None and before.is_active:
            before.execute()
        command = goal.request.command
        self._gripper.force = float(command.max_effort if command.position < self._gap else -command.max_effort)
        self._is_still = False

    def _finish(self, goal: ServerGoalHandle) -> GripperCommand.Result:
        """The result of a goal that has ended: reached, stalled, or replaced by another one."""
        is_reached = abs(self._gap - goal.request.command.position) < _REACHED
        result = GripperCommand.Result(position=self._gap, effort=abs(self._gripper.force), stalled=self._is_still and not is_reached,
                                       reached_goal=is_reached)
        if goal is self._goal:
            goal.succeed()
        else:
            goal.abort()
        return result

    def _publish(self) -> None:
        before, self._position = self._position, self._gripper.world.opening
        message = JointState(name=['left_finger_joint'], position=[self._position], velocity=[(self._position - before) * _JOINT_RATE],
                             effort=[self._gripper.force])
        message.header.stamp = self.get_clock().now().to_msg()
        self._joints.publish(message)
        self._is_still = abs(self._position - before) < _MAX_STANDSTILL
        self._lift_when_held()
        if self._goal is not None and self._goal.is_active and self._is_still and self._gripper.world.time_s > 2 * FRAME_S:
            self._goal.execute()

    def _lift_when_held(self) -> None:
        """Lift by itself, where that is wanted."""
        truth, world = self._gripper.truth, self._gripper.world
        if not self._lifts or truth is None or world.lifted_s >= 0 or not truth.is_held:
            return
        self._held_s = min(self._held_s, truth.time_s)
        if truth.time_s - self._held_s > SETTLED_S:
            world.lift()

    def _lift(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._gripper.world.lift()
        response.success, response.message = True, 'the wrist rises'
        return response

    def _examine(self) -> Health:
        truth, late_s = self._gripper.truth, self._gripper.late_s
        values = {**common_values('running', 1 / FRAME_S), 'late (s)': late_s}
        if truth is not None:
            moved = float(np.linalg.norm(truth.displacement))
            values |= {'grip force (N)': truth.grip_force, 'least force (N)': truth.least_force, 'displacement (mm)': 1e3 * moved,
                       'held': truth.is_held}
        if late_s > _LATE_S:
            return Health(WARN, f'the engine is {late_s:.1f} s behind real time; run it on a machine with less load', values)
        return Health(OK, 'the engine runs in real time', values)

    def destroy_node(self) -> None:
        """Stop the engine first."""
        time.sleep(_DRIVER_ENDS_S)
        self._stopped.set()
        self._thread.join()
        super().destroy_node()


main = process_of(GripperNode)

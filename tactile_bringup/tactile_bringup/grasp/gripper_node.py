# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""gripper_node: a parallel gripper in MuJoCo with an object between its fingers.

The array or the force taxels of its left finger send frames over a pseudo-terminal, as the firmware of real ones over USB; the camera of
the touchpad on its right finger publishes images. Drivers and perception are those of any such sensor.
"""
from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from control_msgs.action import GripperCommand
from rclpy.action import ActionServer
from rclpy.action.server import ServerGoalHandle
from rclpy.node import Node
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_srvs.srv import Trigger

from tactile_driver.emulators import PortEmulator
from tactile_driver.errors import BadArgument
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import OK, WARN, Health, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS, STREAM_QOS, steady_timer
from tactile_driver.nodes.runtime.run import process_of
from tactile_driver.serial.frames import VECTORS
from tactile_driver.simulation.taxel.pad import Ink
from tactile_driver.sources.source import NS

from ..parameters.table import GRIPPER_PARAMETERS
from .constants import GRASP
from .force_pad import ForcePad
from .objects import READY, Disturbance, HeldObject, object_named
from .skin import TouchpadFinger
from .world import GraspTruth, GraspWorld


class SimulatedGripper(PortEmulator):
    """Steps the world at a pace, or slower where the machine is, and sends the numbers of the left finger's sensor.

    pace: simulated s in a s of real time; force: N, of each finger, negative opens; set by another thread. tick: called with the
    simulated time, ns, of each frame before it is sent: start_ns, and what the engine has simulated since.
    """

    runs_on = False

    def __init__(self, link: Path, world: GraspWorld, seed: int, pace: float = 1.0,
                 tick: Callable[[int], None] = lambda _now_ns: None, start_ns: int = 0):
        super().__init__(link, 1 / GRASP.frame_s)
        self.pace = pace
        self.world, self.force, self._tick, self._start_ns = world, -1.0, tick, start_ns
        self.truth: GraspTruth | None = None
        self._sensor = ForcePad(seed) if world.has_domes else Ink((GRASP.taxels, GRASP.taxels), seed, 1 / GRASP.frame_s)
        if world.has_domes:
            self.kind, self.bits = VECTORS, 32
        self._compared = time.monotonic(), 0.0

    def stamp_ns(self, truth: GraspTruth | None) -> int:
        """Simulated time of a moment, ns; of the start without one."""
        return self._start_ns + (round(truth.time_s * NS) if truth else 0)

    def speed(self) -> float:
        """Simulated over real time since the last call."""
        before, simulated = self._compared
        self._compared = time.monotonic(), self.world.time_s
        return (self._compared[1] - simulated) / max(self._compared[0] - before, GRASP.frame_s)

    def _counts(self) -> np.ndarray:
        load, self.truth = self.world.advance(self.force)
        self._tick(self.stamp_ns(self.truth))
        return self._sensor.read(load).astype(np.float32 if self.kind == VECTORS else np.uint16)


class TouchpadCamera:
    """Publishes `~/touchpad/image_raw` and its camera_info, in a thread, while somebody subscribes to the images.

    gripper: of the engine; rate: of the images, Hz of simulated time; a slow machine draws fewer.
    """

    def __init__(self, node: Node, held: HeldObject, gripper: SimulatedGripper, rate: float, seed: int):
        self._node, self._held, self._gripper, self._rate, self._seed = node, held, gripper, rate, seed
        self._image = node.create_publisher(Image, '~/touchpad/image_raw', STREAM_QOS)
        self._info = node.create_publisher(CameraInfo, '~/touchpad/camera_info', LATCHED_QOS)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name='touchpad', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stopped.set()
        self._thread.join()

    def _run(self) -> None:
        finger, due_s = TouchpadFinger(self._held, self._rate, self._seed), 0.0
        while not self._stopped.wait(0.5 * GRASP.frame_s):
            truth = self._gripper.truth
            if truth is not None and truth.time_s >= due_s and self._image.get_subscription_count():
                due_s = max(due_s + 1 / self._rate, truth.time_s + 0.5 * GRASP.frame_s)  # no moment twice
                self._publish(finger, truth)

    def _publish(self, finger: TouchpadFinger, truth: GraspTruth) -> None:
        stamp_ns = self._gripper.stamp_ns(truth)
        header = header_of(stamp_ns, 'touchpad_camera')
        image = finger.advance(truth.object_pose, truth.pad_force).image
        if not self._stopped.is_set():
            self._info.publish(calibration_to_message(finger.calibration, header))
            self._image.publish(image_to_message(Frame(image, stamp_ns, 'bgr8'), '', header))


class GripperSensors(Node):
    """The node of a simulated gripper: its array sends to the port, its touchpad's camera publishes, `~/lift` lifts; with /diagnostics.

    A subclass has the world from _make_world. Raises BadArgument for a wrong parameter, an unknown object, or without MuJoCo.
    """

    _starts_now = True  # whether stamps begin at the real time of the start; else they are the world's

    def __init__(self, host: Host | None = None):
        super().__init__('gripper_node', **(host or Host()).options)
        settings = self._settings = NodeParameters(self, GRIPPER_PARAMETERS)
        if settings.problems:
            raise BadArgument('gripper_node: ' + '; '.join(settings.problems.values()))
        held, disturbances = object_named(settings['object'])
        self._gripper = SimulatedGripper(Path(settings['port']), self._make_world(held, disturbances), settings['seed'],
                                         settings['speed'], self._tick, time.time_ns() if self._starts_now else 0)
        self._lifts, self._held_s = settings['lift'], np.inf
        self._start_serving()
        self._service = self.create_service(Trigger, '~/lift', self._lift)
        self._diagnostics = NodeDiagnostics(self, 'gripper', settings['object'], self._examine)
        guard_services(self)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._gripper.run, args=(self._stopped.is_set,), name='engine', daemon=True)
        self._thread.start()
        self._touchpad = TouchpadCamera(self, held, self._gripper, settings['touchpad_rate'], settings['seed'])

    def _make_world(self, held: HeldObject, disturbances: Sequence[Disturbance]) -> GraspWorld:
        raise NotImplementedError

    def _start_serving(self) -> None:
        """Publishers and servers of the subclass, before the engine starts."""

    def _tick(self, now_ns: int) -> None:
        """Called with the simulated time, ns, of each frame before it is sent."""

    def _start_lift(self) -> None:
        self._gripper.world.lift()

    def _lift_when_held(self) -> None:
        """Lift by itself, where that is wanted."""
        truth, world = self._gripper.truth, self._gripper.world
        if not self._lifts or truth is None or world.lifted_s >= 0 or not truth.is_held:
            return
        self._held_s = min(self._held_s, truth.time_s)
        if truth.time_s - self._held_s > GRASP.settled_s:
            self._start_lift()

    def _lift(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._start_lift()
        response.success, response.message = True, 'the wrist rises'
        return response

    def _examine(self) -> Health:
        truth, speed = self._gripper.truth, self._gripper.speed()
        values = {**common_values('running', speed / GRASP.frame_s), 'speed (of real time)': speed}
        if truth is not None:
            moved = float(np.linalg.norm(truth.displacement))
            values |= {'grip force (N)': truth.grip_force, 'least force (N)': truth.least_force, 'displacement (mm)': 1e3 * moved,
                       'held': truth.is_held}
        if speed < GRASP.min_pace * self._gripper.pace:
            return Health(WARN, f'the engine runs at {100 * speed:.0f} % of real time, and all stamps with it; end other programs', values)
        return Health(OK, f'the engine runs at {100 * speed:.0f} % of real time', values)

    def destroy_node(self) -> None:
        """Stop the engine first."""
        time.sleep(GRASP.driver_end_s)
        self._stopped.set()
        self._touchpad.stop()
        self._thread.join()
        super().destroy_node()


class GripperNode(GripperSensors):
    """Serves the action `gripper_cmd` (control_msgs/GripperCommand) and the service `~/lift`, and publishes /joint_states and /clock.

    A goal presses with max_effort, N, until the gap between the pads is `position`, m; it is reached, or stalled at the object. A new goal
    replaces the present one.
    """

    def _make_world(self, held: HeldObject, disturbances: Sequence[Disturbance]) -> GraspWorld:
        return GraspWorld(held, disturbances, self._settings['pad'])

    def _start_serving(self) -> None:
        self._clock_output = self.create_publisher(Clock, '/clock', STREAM_QOS)
        self._goal: ServerGoalHandle | None = None
        self._position, self._is_still = 0.0, False
        self._joints = self.create_publisher(JointState, '/joint_states', STREAM_QOS)
        self._server = ActionServer(self, GripperCommand, 'gripper_cmd', self._finish, handle_accepted_callback=self._accept)
        steady_timer(self, 1 / GRASP.joint_rate, self._publish)
        self.get_logger().info(f'{READY} {self._settings["port"]}')

    def _tick(self, now_ns: int) -> None:
        self._clock_output.publish(Clock(clock=Time(nanoseconds=now_ns).to_msg()))

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
        is_reached = abs(self._gap - goal.request.command.position) < GRASP.goal_tolerance
        result = GripperCommand.Result(position=self._gap, effort=abs(self._gripper.force), stalled=self._is_still and not is_reached,
                                       reached_goal=is_reached)
        if goal is self._goal:
            goal.succeed()
        else:
            goal.abort()
        return result

    def _publish(self) -> None:
        before, self._position = self._position, self._gripper.world.opening
        message = JointState(name=['left_finger_joint'], position=[self._position], velocity=[(self._position - before) * GRASP.joint_rate],
                             effort=[self._gripper.force])
        message.header.stamp = Time(nanoseconds=self._gripper.stamp_ns(self._gripper.truth)).to_msg()
        self._joints.publish(message)
        self._is_still = abs(self._position - before) < GRASP.max_standstill
        self._lift_when_held()
        if self._goal is not None and self._goal.is_active and self._is_still and self._gripper.world.time_s > 2 * GRASP.frame_s:
            self._goal.execute()


main = process_of(GripperNode)

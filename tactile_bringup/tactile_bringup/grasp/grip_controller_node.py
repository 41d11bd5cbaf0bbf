# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grip_controller: holds an object by the slip, the contacts and the wrench that tactile sensors report; lifecycle node, with any gripper
that has the action GripperCommand or ParallelGripperCommand of control_msgs."""
from __future__ import annotations

import math
import time

from geometry_msgs.msg import WrenchStamped
from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile
from rclpy.task import Future
from rosidl_runtime_py.utilities import get_action
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, WARN, Health, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS, steady_timer
from tactile_driver.nodes.runtime.run import process_of
from tactile_msgs.msg import Contacts, Slip

from ..parameters.table import GRIP_PARAMETERS
from .constants import GRASP
from .controller import GripController, GripLimits, Phase, Reading, slip_probability

_ACTIONS = ('control_msgs/action/GripperCommand', 'control_msgs/action/ParallelGripperCommand')
_NO_GRIPPER = f'no gripper serves the action gripper_cmd, of a type {" or ".join(_ACTIONS)}; start its controller, or remap the action'


class GripControllerNode(LifecycleNode):
    """Services `~/grasp` and `~/release`; parameters of GripLimits can be set while it holds; `~/force` is the command, N. With a sensor
    that measures the shear `~/friction` is the estimated coefficient of friction and `~/friction_error` its standard error.

    When all sensors are lost the last force is held; /diagnostics reports each that is lost. Raises
    BadArgument for limits that contradict each other.
    """

    def __init__(self, host: Host | None = None):
        super().__init__('grip_controller', **(host or Host()).options)
        self._settings = NodeParameters(self, GRIP_PARAMETERS, self._check, self._change)
        if self._settings.problems:
            raise BadArgument('grip_controller: ' + '; '.join(self._settings.problems.values()))
        sensors = ('sensor', 'shear_sensor') if self._settings['shear_sensor'] else ('sensor',)
        self._control = GripController(self._limits(self._settings.values()), sensors)
        self._contact_force, self._sent, self._wrench = math.nan, math.nan, None
        self._is_active, self._grasps_itself, self._inputs = False, self._settings['grasp'], []
        self._gripper: ActionClient | None = None
        self._answer: Future | None = None  # of the gripper's controller, to the last goal
        self._output, self._friction, self._friction_error = (
            self.create_publisher(Float64, f'~/{name}', STREAM_QOS) for name in ('force', 'friction', 'friction_error'))
        self._own_services = [self.create_service(Trigger, f'~/{name}', serve)
                              for name, serve in (('grasp', self._grasp), ('release', self._release))]
        self._diagnostics = NodeDiagnostics(self, 'grip', self._settings['sensor'], self._examine)
        self._lost: tuple[str, ...] = ()  # sensors, as reported last
        guard_services(self)
        steady_timer(self, GRASP.age_check_s, self._wait)
        if self._settings['autostart']:
            self.trigger_configure()
            self.trigger_activate()

    @staticmethod
    def _limits(values: dict) -> GripLimits:
        return GripLimits(**{name: values[name] for name in GripLimits.__dataclass_fields__})

    def _check(self, changes: dict) -> None:
        self._limits(self._settings.values() | changes)

    def _change(self, changes: dict) -> None:
        self._control.change(**{name: value for name, value in changes.items() if name in GripLimits.__dataclass_fields__})

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Subscribe to the sensors."""
        sensor, other = ('/' + self._settings[name].strip('/') for name in ('sensor', 'shear_sensor'))
        inputs = [(Contacts, f'{sensor}/contacts', self._take_contacts), (Slip, f'{sensor}/slip', self._take_slip)]
        if other != '/':
            inputs += [(WrenchStamped, f'{other}/wrench', self._take_wrench), (Slip, f'{other}/slip', self._take_shear_slip)]
        self._inputs = [self.create_subscription(kind, topic, take, QoSProfile(depth=1)) for kind, topic, take in inputs]
        self._is_active = True
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Keep the last force, and follow the sensor no more."""
        for subscription in self._inputs:
            self.destroy_subscription(subscription)
        self._inputs, self._is_active = [], False
        return super().on_deactivate(state)

    def _take_contacts(self, message: Contacts) -> None:
        self._contact_force = sum(contact.force for contact in message.contacts)

    def _take_slip(self, message: Slip) -> None:
        probability = slip_probability(message.state, message.confidence, partial=not self._settings['shear_sensor'])
        self._use(Reading(1e-9 * stamp_ns_of(message.header), self._contact_force, probability), 'sensor')

    def _take_wrench(self, message: WrenchStamped) -> None:
        self._wrench = message

    def _take_shear_slip(self, message: Slip) -> None:
        """Slip of the sensor that measures the shear, whose wrench is published before it."""
        if self._wrench is None or self._wrench.header.stamp != message.header.stamp:
            return
        force = self._wrench.wrench.force
        self._use(Reading(1e-9 * stamp_ns_of(message.header), -force.z, slip_probability(message.state, message.confidence, partial=False),
                          math.hypot(force.x, force.y), message.slipping_fraction), 'shear_sensor')
        friction = self._control.friction
        for publisher, value in ((self._friction, friction.value), (self._friction_error, friction.error)):
            publisher.publish(Float64(data=value))

    def _use(self, reading: Reading, sensor: str) -> None:
        force = self._control.take(reading, sensor)
        self._report_lost()
        if self._grasps_itself and self._has_gripper and not self._control.lost:
            self._control.close()
            self._grasps_itself, force = False, self._control.force
        self._send(force)

    def _wait(self) -> None:
        if self._gripper is None:
            self._find_gripper()
        elif self._answer is not None and not self._answer.done() and time.monotonic() > self._asked_s + GRASP.max_answer_s:
            self._answer.cancel()
            self._command(*self._goal)
        self._control.wait(1e-9 * self.get_clock().now().nanoseconds)
        self._report_lost()

    def _report_lost(self) -> None:
        """Publish at once which sensors are lost: one that launch starts again is back within a period of /diagnostics."""
        lost = self._control.lost
        if lost != self._lost:
            self._lost = lost
            self._diagnostics.update()

    def _find_gripper(self) -> None:
        """Make the client of the type that the gripper's controller serves."""
        name = self.resolve_topic_name('gripper_cmd')  # a client does not apply remappings itself
        served = dict(get_action_names_and_types(self)).get(name, ())
        self._kind = next((kind for kind in _ACTIONS if kind in served), '')
        if self._kind:
            self._gripper = ActionClient(self, get_action(self._kind), name)

    @property
    def _has_gripper(self) -> bool:
        return self._gripper is not None and self._gripper.server_is_ready()

    def _command(self, position: float, force: float) -> None:
        """Send the gripper a goal: a position, and the largest force, N."""
        goal = get_action(self._kind).Goal()
        if self._kind == _ACTIONS[0]:
            goal.command.position, goal.command.max_effort = position, force
        else:
            goal.command.position, goal.command.effort = [position], [force]
        self._goal, self._asked_s = (position, force), time.monotonic()
        self._answer = self._gripper.send_goal_async(goal)

    def _send(self, force: float) -> None:
        """Command the gripper to close with a force, N; a change that is too small to matter is not sent."""
        if self._control.phase is Phase.OPEN:
            return
        self._output.publish(Float64(data=force))
        if not abs(force - self._sent) <= GRASP.min_force_change * force and self._has_gripper:
            self._command(self._settings['closed_position'], force)
            self._sent = force

    def _grasp(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = self._is_active and self._has_gripper
        if response.success:
            self._control.close()
            self._send(self._control.force)
            response.message = 'closing until the sensor touches'
        else:
            response.message = _NO_GRIPPER if self._is_active else 'activate the controller first'
        return response

    def _release(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._control.open()
        self._grasps_itself = False
        self._sent = math.nan
        response.success = self._has_gripper
        if response.success:
            self._command(self._settings['open_position'], self._control.limits.approach_force)
        response.message = 'opening' if response.success else _NO_GRIPPER
        return response

    def _examine(self) -> Health:
        control = self._control
        values = {**common_values(control.phase.value), 'force (N)': control.force, 'slipped at (N)': control.slipped_at,
                  'rises': control.rises, 'needed force (N)': control.needed_force, 'friction': control.friction.value,
                  'friction error': control.friction.error}
        lost = ' and '.join(self._settings[name] for name in control.lost)
        if control.phase is Phase.SENSOR_LOST:
            return Health(ERROR, f'no sensor sends slip: the last force, {control.force:.2f} N, is held; see what their own nodes report',
                          values)
        if control.phase is Phase.HOLD and lost:
            return Health(WARN, f'sensor {lost} sends no slip: the object is held by the other; see what its own nodes report', values)
        if control.phase is Phase.HOLD and control.force >= control.limits.max_force:
            return Health(WARN, f'the force is at max_force, {control.force:.2f} N; raise max_force, or grasp with more friction', values)
        return Health(OK, control.phase.value, values)


main = process_of(GripControllerNode)

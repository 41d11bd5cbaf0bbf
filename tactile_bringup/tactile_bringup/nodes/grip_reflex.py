# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grip_reflex: converts contacts and slip to grip_command; an example of a controller on tactile results, see docs/controllers.md."""
from __future__ import annotations

import sys
from dataclasses import dataclass

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from sensor_msgs.msg import JointState
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import Contacts, Slip

LONGEST_S = 0.1  # chosen: longest interval that counts, since nobody knows whether the object slipped throughout a gap in the data


@dataclass(frozen=True)
class Reflex:
    """hold: force at the first touch, N; most: largest force, N; closing: rate of closing while the object slips, N/s."""

    hold: float = 1.0
    most: float = 10.0
    closing: float = 20.0

    def next_force(self, force: float, touched: bool, slips: bool, interval: float) -> float:
        """Next grip force, N; force, N, was commanded interval s ago. A negative or NaN interval is unknown and counts as 0."""
        if not touched:
            return 0.0
        force = max(force, self.hold)
        if not slips:
            return force
        return min(force + self.closing * (min(interval, LONGEST_S) if interval > 0 else 0.0), self.most)


#: Name -> default, upper limit (the lower limit is 0), description. All values are chosen.
PARAMETERS = {
    'hold': (1.0, 50.0, 'N, grip force from the first touch on'),
    'most': (10.0, 100.0, 'N, largest grip force'),
    'closing': (20.0, 1000.0, 'N/s, by which it grows while the object slips'),
}
JOINT = 'gripper'


class GripReflexNode(Node):
    """Answers each Slip with a command of equal stamp, so that the command identifies the data it answers."""

    def __init__(self):
        super().__init__('grip_reflex')
        self._reflex = Reflex(**{name: self._declared(name, *about) for name, about in PARAMETERS.items()})
        self._force, self._touched, self._last_s = 0.0, False, float('nan')
        self._commands = self.create_publisher(JointState, 'grip_command', 10)
        self.create_subscription(Contacts, 'contacts', self._take_contacts, 10)
        self.create_subscription(Slip, 'slip', self._take_slip, 10)

    def _declared(self, name: str, default: float, highest: float, text: str) -> float:
        allowed = FloatingPointRange(from_value=0.0, to_value=highest)
        return self.declare_parameter(name, default, ParameterDescriptor(description=text, floating_point_range=[allowed], read_only=True)
                                      ).value

    def _take_contacts(self, message: Contacts) -> None:
        self._touched = bool(message.contacts)

    def _take_slip(self, message: Slip) -> None:
        stamp = message.header.stamp
        now_s = stamp.sec + 1e-9 * stamp.nanosec
        self._force = self._reflex.next_force(self._force, self._touched, message.state != Slip.NONE, now_s - self._last_s)
        self._last_s = now_s
        self._commands.publish(JointState(header=message.header, name=[JOINT], effort=[self._force]))


def main(args: list[str] | None = None) -> None:
    """Run the process grip_reflex; exit code 1 and an error line for an invalid parameter."""
    try:
        sys.exit(run_node(GripReflexNode, args))
    except ParameterException as error:
        sys.exit(f'grip_reflex: {error}')


if __name__ == '__main__':
    main()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grip_reflex.launch.py: the object in the simulated gripper is held and released; the command after a touchpad's slip has its stamp."""
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from sensor_msgs.msg import JointState  # noqa: E402
from tactile_msgs.msg import Contacts, Slip  # noqa: E402

pytestmark = pytest.mark.ros


def test_the_object_in_the_gripper_is_held_and_let_go(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'grip_reflex.launch.py')
    ear = listen({'/taxel_array/grip_command': JointState, '/taxel_array/gripper_state': JointState, '/taxel_array/contacts': Contacts})
    commands, states = ear.heard['/taxel_array/grip_command'], ear.heard['/taxel_array/gripper_state']

    def let_go_after_closing():
        forces = [message.effort[0] for message in list(commands)]
        return max(forces, default=0.0) > 2.0 and 0.0 in forces[int(np.argmax(forces)):]
    assert ear.wait_for(let_go_after_closing, 90), launched.log
    slid = [message.position[1] for message in list(states)]
    closed = next(k for k, message in enumerate(list(states)) if message.effort[0] > 2.0)
    assert max(slid[closed:]) < 3e-3, 'it slides by 6 mm where it is lost'
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []


def test_a_slip_over_the_touchpad_is_answered_under_its_own_stamp(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'grip_reflex.launch.py', 'sensor:=touchpad')
    ear = listen({'/touchpad/grip_command': JointState, '/touchpad/slip': Slip})
    commands = ear.heard['/touchpad/grip_command']
    assert ear.wait_for(lambda: any(message.effort[0] > 2.0 for message in list(commands)), 90), launched.log
    ear.wait_for(lambda: False, 0.5)
    slips = dict(zip(ear.stamps('/touchpad/slip'), ear.heard['/touchpad/slip']))
    found = [(slips[stamp].state, message.effort[0]) for stamp, message in zip(ear.stamps('/touchpad/grip_command'), list(commands))
             if stamp in slips]
    assert len(found) > 3 and all(state != Slip.NONE for (state, force), (_, before) in zip(found[1:], found) if force > before > 1.0)
    assert launched.interrupt() == 0, launched.log


def test_a_wrong_force_is_refused(ros2):
    launched = ros2('run', 'tactile_bringup', 'grip_reflex', '--ros-args', '-p', 'most:=-1.0')
    assert launched.wait(30) == 1 and 'most' in launched.log and 'Traceback' not in launched.log

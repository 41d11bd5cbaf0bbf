# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp.launch.py: an object in MuJoCo is grasped, lifted and held by what its array reports over driver and perception."""
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64

from tactile_bringup.grasp.controller import GripLimits
from tactile_msgs.msg import Slip

pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')


def test_a_box_is_grasped_and_lifted(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'object:=light_rough_box', 'demo:=true')
    ear = listen({'/grip_controller/force': Float64, '/array/slip': Slip, '/diagnostics': DiagnosticArray})

    def engine(name):
        return [value.value for message in list(ear.heard['/diagnostics']) for status in message.status
                if status.name.startswith('/gripper_node') for value in status.values if value.key == name]
    forces = ear.heard['/grip_controller/force']
    assert ear.wait_for(lambda: any(message.data >= GripLimits.start_force for message in list(forces)), 120), launched.log
    assert ear.wait_for(lambda: any(float(least) > 0.5 * 0.02 * 9.81 / 2 for least in engine('least force (N)')), 120), launched.log
    assert ear.wait_for(lambda: [float(moved) for moved in engine('displacement (mm)') if moved != 'nan'], 120), launched.log
    assert engine('held')[-1] == 'True'
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == [], launched.log


def test_an_unknown_object_ends_the_launch_in_one_line(ros2):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'object:=piano')
    assert launched.wait(60) != 0
    assert 'object:=piano is none of box, long_box' in launched.log

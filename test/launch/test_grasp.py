# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grasp.launch.py: an object in MuJoCo is grasped, lifted and held by what its array reports over driver and perception."""
import os
import signal
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from tactile_bringup.grasp.controller import GripLimits
from tactile_msgs.msg import Slip

pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')


def test_a_box_is_grasped_and_lifted(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'object:=light_rough_box', 'demo:=true', 'speed:=0.8')
    ear = listen({'/grip_controller/force': Float64, '/array/slip': Slip, '/diagnostics': DiagnosticArray, '/clock': Clock})

    def engine(name):
        return [value.value for message in list(ear.heard['/diagnostics']) for status in message.status
                if status.name.startswith('/gripper_node') for value in status.values if value.key == name]
    forces = ear.heard['/grip_controller/force']
    assert ear.wait_for(lambda: any(message.data >= GripLimits.start_force for message in list(forces)), 120), launched.log
    assert ear.wait_for(lambda: any(float(least) > 0.5 * 0.02 * 9.81 / 2 for least in engine('least force (N)')), 120), launched.log
    assert ear.wait_for(lambda: [float(moved) for moved in engine('displacement (mm)') if moved != 'nan'], 120), launched.log
    assert engine('held')[-1] == 'True' and np.median([float(speed) for speed in engine('speed (of real time)')]) < 0.9
    stamps = np.diff(ear.stamps('/array/slip'))
    assert (stamps > 0).all() and np.median(stamps) == pytest.approx(1e7, rel=0.06), 'of simulated time, though that is slower'
    now = ear.heard['/clock'][-1].clock
    assert abs(now.sec - ear.heard['/array/slip'][-1].header.stamp.sec) <= 1
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == [], launched.log


def processes_of(launched, word):
    """The process numbers of a launch whose command lines hold a word."""
    found = []
    for folder in Path('/proc').glob('[0-9]*'):
        with suppress(OSError):
            if os.getsid(int(folder.name)) == launched.process.pid and word.encode() in (folder / 'cmdline').read_bytes().split(b'\0'):
                found.append(int(folder.name))
    return found


@pytest.mark.parametrize('sensor', ['array', 'touchpad'])
def test_an_object_stays_in_the_hand_when_the_process_of_a_sensor_is_killed(ros2, listen, sensor):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'object:=light_rough_box', 'demo:=true')
    ear = listen({f'/{sensor}/slip': Slip, '/grip_controller/force': Float64, '/diagnostics': DiagnosticArray})

    def of(node):
        return [status for message in list(ear.heard['/diagnostics']) for status in message.status if status.name.startswith(node)]

    def engine(name):
        return [value.value for status in of('/gripper_node') for value in status.values if value.key == name]
    assert ear.wait_for(lambda: [float(moved) for moved in engine('displacement (mm)') if moved != 'nan'], 120), launched.log
    assert ear.wait_for(lambda: ear.heard[f'/{sensor}/slip'], 60), launched.log
    killed, = processes_of(launched, f'__ns:=/{sensor}')
    os.kill(killed, signal.SIGKILL)
    assert ear.wait_for(lambda: any(f'sensor {sensor} sends no slip: the object is held by the other' in status.message
                                    for status in of('/grip_controller')), 60), launched.log
    ear.heard[f'/{sensor}/slip'].clear()
    assert ear.wait_for(lambda: ear.heard[f'/{sensor}/slip'], 120), 'launch starts the process again'
    ear.heard['/diagnostics'].clear()
    assert ear.wait_for(lambda: any(f'sensor {sensor} ' not in status.message and 'no sensor' not in status.message
                                    for status in of('/grip_controller')), 30), launched.log
    assert ear.wait_for(lambda: engine('held'), 30)
    assert engine('held')[-1] == 'True' and float(engine('displacement (mm)')[-1]) < 2.0, launched.log


def installed(*packages):
    """Whether packages are found."""
    with suppress(PackageNotFoundError):
        return all(get_package_prefix(package) for package in packages)
    return False


@pytest.fixture
def simulator(tmp_path, monkeypatch):
    """mujoco_ros2_control and the controllers: the real ones where they are installed, else a program with the same topics."""
    if installed('mujoco_ros2_control', 'gripper_controllers'):
        return
    programs = {'mujoco_ros2_control/ros2_control_node': Path(__file__).with_name('simulator_stand_in.py').read_text(),
                'controller_manager/spawner': '#!/bin/sh\n'}
    for package in ('mujoco_ros2_control', 'controller_manager', 'gripper_controllers', 'joint_state_broadcaster',
                    'joint_trajectory_controller', 'pose_broadcaster'):
        index = tmp_path / 'prefix' / 'share' / 'ament_index' / 'resource_index' / 'packages' / package
        index.parent.mkdir(parents=True, exist_ok=True)
        index.touch()
    for name, text in programs.items():
        program = tmp_path / 'prefix' / 'lib' / name
        program.parent.mkdir(parents=True)
        program.write_text(text)
        program.chmod(0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', os.pathsep.join([str(tmp_path / 'prefix'), os.environ['AMENT_PREFIX_PATH']]))


def test_a_box_is_grasped_and_lifted_under_ros2_control(ros2, listen, simulator):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'object:=light_rough_box', 'demo:=true', 'ros2_control:=true',
                    'speed:=0.5')
    ear = listen({'/array/slip': Slip, '/diagnostics': DiagnosticArray, '/joint_states': JointState,
                  '/hand/object': PoseWithCovarianceStamped})

    def engine(name):
        return [value.value for message in list(ear.heard['/diagnostics']) for status in message.status
                if status.name.startswith('/gripper_node') for value in status.values if value.key == name]

    def joint(name):
        return [message.position[list(message.name).index(name)] for message in list(ear.heard['/joint_states'])[-1:]]
    assert ear.wait_for(lambda: joint('lift_joint') and joint('lift_joint')[0] > 0.095, 120), launched.log
    assert ear.wait_for(lambda: [float(moved) for moved in engine('displacement (mm)') if moved != 'nan'], 30), launched.log
    assert engine('held')[-1] == 'True' and float(engine('displacement (mm)')[-1]) < 2.0
    assert float(engine('grip force (N)')[-1]) > float(engine('least force (N)')[-1]) > 0.5 * 0.02 * 9.81 / 2
    assert (np.diff(ear.stamps('/array/slip')) > 0).all() and ear.heard['/hand/object'], launched.log
    assert launched.interrupt() == 0, launched.log
    assert [line for line in launched.complaints if not line.startswith('[ros2_control_node')] == [], launched.log


def test_a_simulator_that_dies_ends_the_launch(ros2, simulator):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'ros2_control:=true')
    launched.wait_for_line(r'ros2_control_node-.\]: process started', 60)
    killed, = processes_of(launched, 'gripper_controller:=warn')
    os.kill(killed, signal.SIGKILL)
    assert launched.wait(60) == 1 and 'the simulator ended with exit code -9' in launched.log


@pytest.mark.skipif(installed('mujoco_ros2_control', 'controller_manager', 'gripper_controllers', 'joint_state_broadcaster',
                              'joint_trajectory_controller', 'pose_broadcaster'), reason='needs a machine without them')
def test_packages_of_ros2_control_that_are_missing_end_the_launch_in_one_line(ros2):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'ros2_control:=true')
    assert launched.wait(60) == 1
    assert 'not installed: sudo apt install ros-jazzy-mujoco-ros2-control' in launched.log and 'Traceback' not in launched.log


def test_an_unknown_object_ends_the_launch_in_one_line(ros2):
    launched = ros2('launch', 'tactile_bringup', 'grasp.launch.py', 'object:=piano')
    assert launched.wait(60) != 0
    assert 'object:=piano is not one of box, long_box' in launched.log

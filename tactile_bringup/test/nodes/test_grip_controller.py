# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""grip_controller: the commands that a gripper's controller gets, of the type and under the name that it serves."""
import pytest
from control_msgs import action
from geometry_msgs.msg import WrenchStamped
from rclpy.action import ActionClient, ActionServer
from rclpy.task import Future
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from tactile_bringup.grasp.grip_controller_node import GripControllerNode
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS
from tactile_msgs.msg import Slip


@pytest.mark.parametrize('kind', ['GripperCommand', 'ParallelGripperCommand'])
def test_a_gripper_of_either_type_is_closed_and_opened_under_a_name_of_its_own(bench, kind):
    if not hasattr(action, kind):
        pytest.skip(f'{kind} of control_msgs is not in the environment that setup.bash makes')
    other, until = bench(lambda: GripControllerNode(Host(
        ['-r', 'gripper_cmd:=/gripper_controller/gripper_cmd'],
        {'closed_position': 0.8, 'open_position': -0.1, 'approach_force': 1.5, 'start_force': 3.0, 'max_force': 9.0})))
    goals, answers = [], []

    def execute(goal):
        command = goal.request.command
        goals.append((command.position, command.max_effort) if kind == 'GripperCommand' else (command.position[0], command.effort[0]))
        goal.succeed()
        return getattr(action, kind).Result()

    def ask(service):
        client = other.create_client(Trigger, f'/grip_controller/{service}')
        assert until(client.service_is_ready)
        answer = client.call_async(Trigger.Request())
        assert until(answer.done)
        answers.append(answer.result())
        return answers[-1].success
    assert not ask('grasp') and 'no gripper serves the action gripper_cmd' in answers[-1].message
    server = ActionServer(other, getattr(action, kind), '/gripper_controller/gripper_cmd', execute)
    assert until(lambda: ask('grasp')), answers[-1]
    assert until(lambda: goals) and goals[-1] == pytest.approx((0.8, 1.5))
    assert ask('release') and until(lambda: len(goals) > 1)
    assert goals[-1] == pytest.approx((-0.1, 1.5))
    server.destroy()


def test_a_goal_that_is_not_answered_is_sent_again(bench, monkeypatch):
    other, until = bench(lambda: GripControllerNode(Host([], {'approach_force': 1.5})))
    sent, goals, send = [], [], ActionClient.send_goal_async

    def send_but_the_first(client, goal):
        sent.append(goal.command.max_effort)
        return send(client, goal) if len(sent) > 1 else Future()  # a server in C++ drops a goal of a client that it has not discovered

    def execute(goal):
        goals.append(goal.request.command.max_effort)
        goal.succeed()
        return action.GripperCommand.Result()
    monkeypatch.setattr(ActionClient, 'send_goal_async', send_but_the_first)
    server = ActionServer(other, action.GripperCommand, 'gripper_cmd', execute)
    client = other.create_client(Trigger, '/grip_controller/grasp')

    def is_grasping():
        answer = client.call_async(Trigger.Request())
        return until(answer.done) and answer.result().success
    assert until(client.service_is_ready) and until(is_grasping)
    assert until(lambda: goals) and goals == [1.5] and sent == [1.5, 1.5]
    server.destroy()


def test_a_controller_that_grasps_by_itself_waits_for_both_sensors(bench):
    other, until = bench(lambda: GripControllerNode(Host([], {'sensor': 'array', 'shear_sensor': 'touchpad', 'grasp': True})))
    goals = []

    def execute(goal):
        goals.append(goal.request.command.max_effort)
        goal.succeed()
        return action.GripperCommand.Result()
    server = ActionServer(other, action.GripperCommand, 'gripper_cmd', execute)
    array, touchpad = (other.create_publisher(Slip, f'/{name}/slip', STREAM_QOS) for name in ('array', 'touchpad'))
    wrench = other.create_publisher(WrenchStamped, '/touchpad/wrench', STREAM_QOS)
    assert until(lambda: all(publisher.get_subscription_count() for publisher in (array, touchpad, wrench)))

    def report(publishers):
        header = Header(stamp=other.get_clock().now().to_msg())
        for publisher in publishers:
            publisher.publish(WrenchStamped(header=header) if publisher is wrench else Slip(header=header, confidence=0.9))
        return until(lambda: goals, patience_s=0.1)
    assert not any(report([array]) for _ in range(10)), 'the touchpad is still to come'
    assert any(report([wrench, touchpad, array]) for _ in range(100))
    server.destroy()

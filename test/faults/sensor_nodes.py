# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes that the launch file of each sensor starts, made in this process."""
from __future__ import annotations

from rclpy.node import Node
from tactile_bringup.hand_file import HandSensor
from tactile_bringup.hand_launch import hand_arguments, planned_sensor
from tactile_bringup.hand_processes import PlannedNode
from tactile_bringup.nodes.compose import Plan, kind_of
from tactile_driver.nodes.host import Host


def plans(sensor_type: str, space: str) -> list[PlannedNode]:
    """Of a simulated sensor whose driver waits to be configured."""
    given = {argument.name: '' for argument in hand_arguments()} | {'source': 'sim', 'autostart': 'false', 'composed': 'sensor'}
    return planned_sensor(HandSensor(space.strip('/'), sensor_type, 'hand'), given).nodes


def made(plan: PlannedNode) -> Node:
    """The node as it is alone in a process. Raises TactileError."""
    told = Plan(plan.executable, f'/{plan.namespace.strip("/")}', plan.params)
    return kind_of(told)(Host(told.arguments, plan.own))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The nodes that the launch file of each sensor starts, created in this process."""
from __future__ import annotations

from rclpy.node import Node
from tactile_bringup.hand.description import HandSensor
from tactile_bringup.launch.hand import hand_arguments, planned_sensor
from tactile_bringup.launch.arguments import SensorPlan
from tactile_driver.nodes.runtime.host import Host
from tactile_perception.node import make_node


def planned(sensor_type: str, space: str) -> SensorPlan:
    """Of a simulated sensor whose driver waits to be configured."""
    given = dict.fromkeys(hand_arguments(), '') | {'source': 'sim', 'autostart': 'false', 'composed': 'true'}
    return planned_sensor(HandSensor(space.strip('/'), sensor_type, 'hand'), given)


def made(plan: SensorPlan, name: str, **more) -> Node:
    """The node of this name as it is alone in a process; more: parameters that it has besides. Raises TactileError."""
    return make_node(name, Host(['-r', f'__ns:=/{plan.namespace}', '--params-file', plan.params], {**plan.nodes[name], **more}))

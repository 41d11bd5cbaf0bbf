# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in this process that are fed by calls, as by a driver that shares their process: no middleware between."""
from __future__ import annotations

import itertools
from collections import Counter

from rclpy.serialization import serialize_message
from tactile_bringup.nodes.compose import Plan, kind_of
from tactile_bringup.sensor_launch import share
from tactile_driver.nodes.host import Host, SharedPublisher

_NUMBERS = itertools.count(1)
INPUTS = {'dot_tracker_node': ('camera_info', 'image_raw'), 'contact_region_node': ('camera_info', 'dots'),
          'contact_point_node': ('camera_info', 'dots'), 'psd_contact_node': ('voltages',), 'taxel_contact_node': ('image_raw',)}


class Nobody:
    """In place of a publisher of the middleware."""

    def __init__(self, topic: str):
        self.topic_name = topic

    def get_subscription_count(self) -> int:
        return 0


class Sink:
    """In place of a publisher, with somebody who listens: what is published has to be a message that the middleware takes."""

    def __init__(self, topic: str):
        self.topic_name, self.published = topic, []

    def get_subscription_count(self) -> int:
        return 1

    def publish(self, message) -> None:
        serialize_message(message)
        self.published.append(message)


class FedNode:
    """A perception node by its name, with the parameters that ship for a simulated sensor. results: (topic, message) as published."""

    def __init__(self, name: str, sensor: str, **parameters):
        self.name, space = name, f'/fed{next(_NUMBERS)}'
        self._shared = {f'{space}/{topic}': SharedPublisher(Nobody(f'{space}/{topic}'), lambda: None) for topic in INPUTS[name]}
        self._space, self.results, self.counts = space, [], Counter()
        own = {name.replace('__', '.'): value for name, value in parameters.items()}
        plan = Plan(name, space, str(share('params', f'{sensor}_sim.yaml')), own)
        self.node = kind_of(plan)(Host(plan.arguments, plan.parameters, self._shared))
        for topic, publisher in self.node._outputs.items():
            publisher.attach(lambda message, _sent, topic=topic: self._take(topic, message))

    def _take(self, topic: str, message) -> None:
        serialize_message(message)
        self.results.append((topic, message))

    def feed(self, topic: str, message) -> list[tuple[str, object]]:
        """What is published for a message."""
        self.results = []
        self._shared[f'{self._space}/{topic}'].publish(message)
        return self.results

    def close(self) -> None:
        self.node.destroy_node()

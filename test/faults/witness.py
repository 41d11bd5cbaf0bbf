# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A listener process on another network: it writes one line per message received from a sensor."""
from __future__ import annotations

import os
import sys
import time
from typing import NamedTuple

from emulated import samples
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Image
from tactile_driver.nodes.runtime.run import run_node
from tactile_msgs.msg import Contacts, PsdVoltages

_KINDS = {'voltages': PsdVoltages, 'contacts': Contacts, 'image_raw': Image}


class Line(NamedTuple):
    """A message: its topic, when it came (monotonic s), its age then (s), its stamp (ns), its first and last sample (-1: none)."""

    topic: str
    at: float
    age: float
    stamp: int
    first: int
    last: int


class Witness(Node):
    """Listens, reliable."""

    def __init__(self):
        super().__init__(f'witness_{os.getpid()}')
        for topic, kind in _KINDS.items():
            self.create_subscription(kind, topic, lambda message, topic=topic: self._write(topic, message), QoSProfile(depth=500))

    def _write(self, topic: str, message) -> None:
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        numbers = samples([message])[:, 0] if topic == 'voltages' else (-1,)
        print(*Line(topic, time.monotonic(), time.time() - 1e-9 * stamp, stamp, numbers[0], numbers[-1]), flush=True)


def written(log: str) -> dict[str, list[Line]]:
    """The lines of each topic in a witness' log, without one that is not yet written to its end."""
    lines: dict[str, list[Line]] = {topic: [] for topic in _KINDS}
    for words in (line.split() for line in log[:log.rfind('\n') + 1].splitlines()):
        if words and words[0] in lines:
            lines[words[0]].append(Line(words[0], float(words[1]), float(words[2]), *map(int, words[3:])))
    return lines


def main() -> None:
    """The process."""
    sys.exit(run_node(Witness))

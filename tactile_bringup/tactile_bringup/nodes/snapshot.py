# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""snapshot: writes a PNG with the annotated image and the RViz markers of each sensor.

    ros2 run tactile_bringup snapshot OUT.png [--hand FILE]
"""
from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import rclpy
import yaml
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import Image
from std_msgs.msg import String
from tactile_driver.command import tells_errors
from tactile_driver.errors import TactileError
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from visualization_msgs.msg import MarkerArray

from ..hand.description import names_in
from ..visualization.markers.picture import marker_picture
from ..visualization.tiles import SCENE, sheet, tile

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_SETTLE_S = 2.5  # chosen: time until the middleware has discovered all sensors
_LOOK_S = 0.5  # chosen: interval between two searches for sensors
_TOPICS = {'image_annotated': Image, 'markers': MarkerArray}


@dataclass
class Seen:
    """Type of one sensor, '' while it is not known, and the last message of each topic that its tile shows."""

    type: str = ''
    messages: dict[str, object] = field(default_factory=dict)

    def take(self, topic: str, message) -> None:
        """Keep a message; of markers those that show more than a warning."""
        if topic != 'markers' or any(marker.points for marker in message.markers):
            self.messages[topic] = message

    @property
    def missing(self) -> list[str]:
        """What has not been received."""
        return [topic for topic in _TOPICS if topic not in self.messages] if self.type else ['description']


class SnapshotNode(Node):
    """Finds sensors by their descriptions and keeps the last message of each topic drawn; names: of expected sensors."""

    def __init__(self, names: Collection[str]):
        super().__init__('snapshot')
        self.seen: dict[str, Seen] = {}
        for name in names:
            self._look_at(name)
        steady_timer(self, _LOOK_S, self._find)

    def _find(self) -> None:
        for topic, kinds in self.get_topic_names_and_types():
            name = topic.strip('/').removesuffix('/description')
            if topic == f'/{name}/description' and 'std_msgs/msg/String' in kinds and name not in self.seen:
                self._look_at(name)

    def _look_at(self, name: str) -> None:
        self.seen[name] = Seen()
        self.create_subscription(String, f'/{name}/description', lambda message: self._take_description(name, message), _LATCHED)

    def _take_description(self, name: str, message: String) -> None:
        seen = self.seen[name]
        try:
            about = yaml.safe_load(message.data)
        except (yaml.YAMLError, ValueError, RecursionError):  # another package's topic of that name
            return
        if seen.type or not isinstance(about, dict):
            return
        seen.type = str(about.get('sensor_type', ''))
        for topic, kind in _TOPICS.items():
            self.create_subscription(kind, f'/{name}/{topic}', lambda message, topic=topic: seen.take(topic, message),
                                     qos_profile_sensor_data)


def tile_of(name: str, seen: Seen) -> np.ndarray:
    """The tile of a sensor, from the messages received."""
    title, picture = f'{name}   {seen.type or "not found"}', None
    try:
        picture = image_to_array(seen.messages['image_annotated']) if 'image_annotated' in seen.messages else None
    except TactileError as error:
        title = f'{title}   {error}'
    scene = marker_picture(seen.messages['markers'].markers, SCENE) if 'markers' in seen.messages else None
    return tile(title, picture, scene)


def collect(node: SnapshotNode, patience_s: float) -> None:
    """Collect messages until each sensor found is complete, at most patience_s."""
    with SingleThreadedExecutor() as executor:
        executor.add_node(node)
        begin = time.monotonic()
        while (passed := time.monotonic() - begin) < patience_s:
            executor.spin_once(timeout_sec=0.1)
            if passed > _SETTLE_S and node.seen and not any(seen.missing for seen in node.seen.values()):
                return


def write(path: Path, seen: dict[str, Seen]) -> str:
    """Write the picture; the error message, '' for success."""
    if not any(each.type for each in seen.values()):
        return 'no sensor was found; is the hand launched, in this ROS domain?'
    picture = sheet([tile_of(name, seen[name]) for name in sorted(seen)])
    good, data = cv2.imencode('.png', picture)
    try:
        path.write_bytes(data.tobytes() if good else b'')
    except OSError as error:
        return f'{path} cannot be written: {error}'
    print(path)
    missing = [f'{name} ({", ".join(each.missing)})' for name, each in sorted(seen.items()) if each.missing]
    return f'no message from {"; ".join(missing)}' if missing else ''


@tells_errors('snapshot')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 1 when a sensor is missing or the file cannot be written."""
    parser = argparse.ArgumentParser(prog='snapshot', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('out', type=Path, help='PNG file to write')
    parser.add_argument('--hand', type=Path, help='YAML file of the hand: its sensors are waited for')
    parser.add_argument('--patience', type=float, default=30.0, help='longest time to wait for all sensors, s')
    given = parser.parse_args(remove_ros_args(sys.argv if args is None else ['snapshot', *args])[1:])
    names = names_in(given.hand)
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node = SnapshotNode(names)
    try:
        collect(node, given.patience)
    except ExternalShutdownException:
        return 1
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    problem = write(given.out, node.seen)
    if problem:
        print(f'snapshot: {problem}', file=sys.stderr)
    return 1 if problem else 0

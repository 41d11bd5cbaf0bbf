# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of dot_tracker_node, tuned by what one sees: candidates and mask over the image, and a file of what was set."""
from __future__ import annotations

import math
import time
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import rerun as rr
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from tactile_driver.errors import TactileError
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import RawMessage
from tactile_driver.recordings.serialization import decode
from tactile_perception.core.parameter_files import write_parameters
from tactile_perception.dots.appearance import find_candidates
from tactile_perception.dots.detect import POLARITIES
from tactile_perception.dots.parameters import TUNED
from tactile_perception.dots.tracker import Mask

from .constants import VIEW

_TRACKER = 'dot_tracker_node'
_COLOURS = {1: (255, 160, 0), -1: (0, 200, 255)}  # of bright and of dark candidates
_MASK = (255, 0, 255)


class Tuning:
    """Draws what dot_tracker_node could take for dots, and what its mask leaves; its dots are drawn from its messages.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Where that is logged.
    file : Path
        Parameter file to write when a parameter is set.
    """

    def __init__(self, stream: rr.RecordingStream, file: Path):
        self._stream, self._file = stream, file
        self._values: dict[str, dict[str, str]] = {}  # namespace of a tracker -> parameter -> value
        self._clients: dict[str, object] = {}
        self._drawn_s: dict[str, float] = {}  # image topic -> when its candidates were drawn

    def follow(self, node: Node) -> None:
        """Find the trackers, and what is set on them, by a node that is spun."""
        node.create_subscription(ParameterEvent, '/parameter_events', self._take_event, 100)
        node.create_timer(VIEW.node_check_s, partial(self._look, node))

    def _look(self, node: Node) -> None:
        for name, space in node.get_node_names_and_namespaces():
            if name == _TRACKER and space not in self._values:
                if space not in self._clients:
                    self._clients[space] = node.create_client(GetParameters, f'{space}/{_TRACKER}/get_parameters')
                if self._clients[space].service_is_ready():
                    self._values[space] = {}
                    self._clients[space].call_async(GetParameters.Request(names=TUNED)).add_done_callback(partial(self._take_values, space))

    def _take_values(self, space: str, future) -> None:
        found = [parameter_value_to_python(value) for value in future.result().values]
        self._values[space] = dict(zip(TUNED, found)) | self._values[space]

    def _take_event(self, event: ParameterEvent) -> None:
        space, _, name = event.node.rpartition('/')
        changed = {each.name: parameter_value_to_python(each.value) for each in event.changed_parameters if each.name in TUNED}
        if name == _TRACKER and changed:
            self._values.setdefault(space, {}).update(changed)
            self._drawn_s.clear()
            write_parameters(self._file, {'sensor_type': 'dots', **self._values[space]})
            print(f'view: {self._file}: ' + ', '.join(f'{each}: {value}' for each, value in changed.items()), flush=True)

    def take(self, message: RawMessage) -> None:
        """Draw candidates and mask over an image of a tracker's namespace."""
        values = self._values.get(message.topic.rpartition('/')[0])
        drawn_s = self._drawn_s.get(message.topic, -math.inf)
        if not values or not message.type_name.endswith('Image') or time.monotonic() - drawn_s < VIEW.candidates_s:
            return
        self._drawn_s[message.topic] = time.monotonic()
        try:
            image = image_to_array(decode(message.data, message.type_name))
            mask = Mask(values['mask']).outlines(image.shape[:2]) if values['mask'] else []
            found = find_candidates(image, POLARITIES[values['polarity']])
        except (TactileError, cv2.error):
            return  # the node says so on /diagnostics
        for path, what in drawings(found, mask).items():
            self._stream.log(f'{message.topic}/{path}', what)


def drawings(found: dict, mask: list[np.ndarray]) -> dict[str, object]:
    """Entity below the image -> candidates by sign as circles, and the rings (N, 2) px of a mask."""
    circles = {sign: _circles(peaks.uv, peaks.diameter) for sign, peaks in found.items()}
    return {'mask': rr.LineStrips2D([np.vstack([ring, ring[:1]]) for ring in mask], colors=_MASK),
            'candidates': rr.LineStrips2D([ring for rings in circles.values() for ring in rings],
                                          colors=[_COLOURS[sign] for sign, rings in circles.items() for _ in rings])}


def _circles(uv: np.ndarray, diameter: np.ndarray) -> list[np.ndarray]:
    angle = np.linspace(0, 2 * np.pi, 13)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return list(uv[:, None] + 0.5 * diameter[:, None, None] * ring)

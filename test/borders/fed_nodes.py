# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in this process that receive messages by direct calls, without middleware; valid messages by sensor type: raw ones of a simulated
sensor, untouched and then pressed."""
from __future__ import annotations

import copy
import functools
import itertools
from array import array

import cv2
import numpy as np
import rig
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from tactile_bringup import share
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.nodes.runtime.host import Host, SharedPublisher
from tactile_perception.core.node import make_node

_NUMBERS = itertools.count(1)
_IMAGES = 'camera_info', 'image_raw'
INPUTS = {'touchpad_contact_node': _IMAGES, 'press_contact_node': _IMAGES, 'psd_contact_node': ('voltages',),
          'taxel_contact_node': ('image_raw',)}
PERCEPTION = {'touchpad': 'touchpad_contact_node', 'areal_single': 'press_contact_node', 'air_cushion': 'press_contact_node',
              'psd_finger': 'psd_contact_node', 'taxel_array': 'taxel_contact_node'}
MARKERS = {'touchpad': 'markers_node', 'areal_single': 'markers_node', 'psd_finger': 'finger_markers_node',
           'taxel_array': 'taxel_markers_node'}
#: (node, sensor), each once
NODES = [(name, sensor) for sensor, name in PERCEPTION.items()] + [(name, sensor) for sensor, name in MARKERS.items()]
BEGIN_NS = 1_700_000_000 * 10**9
_PERIOD_NS = {'psd_finger': 10**7, 'taxel_array': 10**7}  # of messages; else 0.1 s
_BLOCK = 10


@functools.cache
def messages(sensor: str) -> list[tuple[str, object]]:
    """(topic, message) in the order in which they are sent; nobody may change them."""
    of, found = rig.seen(sensor), []
    chain = of.chain()
    if sensor == 'psd_finger':
        raws, topic = np.concatenate([*of.rest, of.pressed]).reshape(-1, _BLOCK, 4), 'voltages'
    else:
        raws, topic = [*of.rest, *[of.pressed] * 20] if sensor == 'taxel_array' else [*of.rest[:3], *[of.pressed] * 3], 'image_raw'
    for number, raw in enumerate(raws):
        stamp = BEGIN_NS + number * _PERIOD_NS.get(sensor, rig.STEP_NS)
        if of.info is not None:
            info = copy.deepcopy(of.info)
            info.header = header_of(stamp, sensor)
            found.append(('camera_info', info))
        found.append((topic, chain.message(raw, stamp)))
    return found


def compressed(image: Image, kind: str) -> CompressedImage:
    """The same image under the same header; kind: .png or .jpg."""
    data = cv2.imencode(kind, image_to_array(image))[1]
    return CompressedImage(header=image.header, format=kind[1:], data=array('B', data.tobytes()))


def arguments(space: str, sensor: str) -> list[str]:
    """ROS arguments of a node of a simulated sensor."""
    return ['-r', f'__ns:={space}', '--params-file', str(share('params', f'{sensor}_sim.yaml'))]


def own_parameters(name: str, sensor: str) -> dict[str, str]:
    """What a launch file adds to the parameter file."""
    own = {'frame_id': sensor} if name in ('touchpad_contact_node', 'press_contact_node') else {}
    return own | ({'calibration': str(share('calibration', f'{sensor}_sim.yaml'))} if name == 'press_contact_node' else {})


class Nobody:
    """Stands in for a publisher of the middleware."""

    def __init__(self, topic: str):
        self.topic_name = topic

    def get_subscription_count(self) -> int:
        return 0


class Sink:
    """Stands in for a publisher with a subscriber: what is published has to be a message that the middleware takes."""

    def __init__(self, topic: str):
        self.topic_name, self.published = topic, []

    def get_subscription_count(self) -> int:
        return 1

    def publish(self, message) -> None:
        serialize_message(message)
        self.published.append(message)


class FedNode:
    """A perception node by its name, with the parameters that ship for a simulated sensor. results: (topic, message) as published."""

    def __init__(self, name: str, sensor: str):
        self.name, space = name, f'/fed{next(_NUMBERS)}'
        self._shared = {f'{space}/{topic}': SharedPublisher(Nobody(f'{space}/{topic}'), lambda: None) for topic in INPUTS[name]}
        self._space, self.results = space, []
        own = own_parameters(name, sensor)
        self.node = make_node(name, Host(arguments(space, sensor), own, self._shared))
        for topic, publisher in self.node.outputs.items():
            publisher.attach(lambda message, _sent, topic=topic: self._take(topic, message))

    def _take(self, topic: str, message) -> None:
        serialize_message(message)
        self.results.append((topic, message))

    def feed(self, topic: str, message) -> list[tuple[str, object]]:
        """What is published for a message."""
        self.results = []
        if topic in INPUTS[self.name]:
            self._shared[f'{self._space}/{topic}'].publish(message)
        return self.results

    def close(self) -> None:
        self.node.destroy_node()


def sent(sensor: str) -> list[tuple[str, object]]:
    """(topic, message) of all that the sensor's driver and its perception node send, in order."""
    return list(_sent(sensor))


@functools.cache
def _sent(sensor: str) -> tuple:
    node, found = FedNode(PERCEPTION[sensor], sensor), []
    for topic, message in messages(sensor):
        found += [(topic, message), *node.feed(topic, message)]
    node.close()
    return tuple(found)


class FedMarkers:
    """The node that draws a sensor, with somebody who looks at all that it draws."""

    def __init__(self, name: str, sensor: str):
        own = {} if name == 'markers_node' else {'rate': 1000.0}  # each set is drawn
        self.name, self.node = name, make_node(name, Host(arguments(f'/fed{next(_NUMBERS)}', sensor), own))
        self.markers, self.pictures = Sink('markers'), Sink('image_annotated')
        self.node.marker_output, self.node.picture_output = self.markers, self.pictures
        self.node.look_timer.cancel()
        self.node.expected = {topic for topic, _ in sent(sensor)} & {*self.node.marked, *self.node.pictured}

    def feed(self, topic: str, message) -> list[tuple[str, object]]:
        """What is drawn for a message."""
        self.markers.published, self.pictures.published = [], []
        if topic in self.node.expected:
            self.node.take(topic, message, 0)
        elif topic == 'camera_info':
            self.node.take_camera_info(message, 0)
        return [('markers', drawn) for drawn in self.markers.published] + [('image_annotated', drawn) for drawn in self.pictures.published]

    def close(self) -> None:
        self.node.destroy_node()


def fed(name: str, sensor: str) -> FedNode | FedMarkers:
    """The node of that name."""
    return (FedMarkers if 'markers' in name else FedNode)(name, sensor)


def at(message, stamp_ns: int):
    """The message with another stamp; the rest is shared."""
    other = copy.copy(message)
    other.header = Header(frame_id=message.header.frame_id)
    other.header.stamp.sec, other.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    return other

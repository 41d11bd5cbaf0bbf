# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ground truth on ground_truth/*: of a simulated sensor, or as recorded."""
from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from geometry_msgs.msg import PointStamped, Quaternion, Transform, Twist, Wrench, WrenchStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header

from tactile_msgs.msg import Contact, ContactRegion, Contacts, Slip

from ...recordings.truth import RecordedTruth
from ...simulation.truth import Touch, TruthFrame
from ...sources.source import NS
from ..constants import NODES
from .conversions import header_of, point, polygon, quaternion_of, stamp_ns_of, vector

_NAN = float('nan')
#: Name of a topic under ground_truth/ -> its type.
TRUTH = {'tip': PointStamped, 'contacts': Contacts, 'contact_region': ContactRegion, 'slip': Slip, 'wrench': WrenchStamped}
#: a block of samples has several
_QOS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)


class TouchNumbers:
    """Ids of contacts: the contact nearest to a previous one, within 5 mm, keeps its id."""

    def __init__(self):
        self._last: dict[int, np.ndarray] = {}
        self._next = 0

    def assign(self, touches: list[Touch]) -> list[int]:
        """One id for each contact of a frame."""
        free, numbers = dict(self._last), []
        for touch in touches:
            best = min(free, key=lambda k: np.linalg.norm(free[k] - touch.position), default=None)
            if best is None or np.linalg.norm(free[best] - touch.position) > NODES.max_contact_step:
                best, self._next = self._next, self._next + 1
            free.pop(best, None)
            numbers.append(best)
        self._last = {n: touch.position for n, touch in zip(numbers, touches)}
        return numbers


def contacts_message(touches: list[Touch], numbers: list[int], header: Header) -> Contacts:
    """Message of the separate contacts."""
    return Contacts(header=header, contacts=[
        Contact(id=n, position=point(t.position), normal=vector(t.normal), depth=float(t.depth), force=float(t.force))
        for n, t in zip(numbers, touches)])


def _transform(motion: np.ndarray) -> Transform:
    """A motion (6,), m and rad (rotation vector), of the point at the origin, as p(now) = rotation p(before) + translation."""
    x, y, z, w = quaternion_of(motion[3:])
    return Transform(translation=vector(motion[:3]), rotation=Quaternion(x=x, y=y, z=z, w=w))


def region_message(truth: TruthFrame, interval: float, header: Header) -> ContactRegion:
    """Dot states, outlines, area, centroid, normal and the object's motion over interval s; the truth gives no axes (NaN)."""
    known = bool(np.isfinite(truth.motion).all())
    return ContactRegion(
        header=header, dot_id=array('I', np.asarray(truth.dot_id, np.uint32).tobytes()),
        dot_state=array('B', np.asarray(truth.dot_state, np.uint8).tobytes()),
        outlines=[polygon(o) for o in truth.outlines], holes=[polygon(h) for h in truth.holes], area=float(truth.area),
        centroid=point(truth.centroid), normal=vector(truth.normal), orientation=_NAN, major_axis=_NAN, minor_axis=_NAN,
        motion=_transform(truth.motion), motion_interval=interval if known else _NAN, pose=_transform(truth.pose))


def truth_messages(truth: TruthFrame, ids: list[int], interval: float, header: Header,
                   names: Sequence[str] = tuple(TRUTH)) -> dict[str, object]:
    """Name -> message of ground_truth/*, those of names; ids: of the touches (see TouchNumbers); interval: s between frames.

    Slip is that of the whole contact, the wrench that of the object on the sensor.
    """
    velocity = Twist(linear=vector(truth.velocity[:3]), angular=vector(truth.velocity[3:]))
    wrench = Wrench(force=vector(truth.wrench[:3]), torque=vector(truth.wrench[3:]))
    make = {'tip': lambda: PointStamped(header=header, point=point(truth.tip)),
            'contacts': lambda: contacts_message(truth.contacts, ids, header),
            'contact_region': lambda: region_message(truth, interval, header),
            'slip': lambda: Slip(header=header, state=int(truth.slip_state), slipping_fraction=float(truth.slipping_fraction),
                                 velocity=velocity, rotation_center=point(truth.rotation_center), confidence=_NAN),
            'wrench': lambda: WrenchStamped(header=header, wrench=wrench)}
    return {name: make[name]() for name in names}


def recorded_truth(truth: TruthFrame, numbers: TouchNumbers, interval: float, header: Header,
                   names: Sequence[str] = tuple(TRUTH)) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message) of truth_messages, for a recording."""
    for name, message in truth_messages(truth, numbers.assign(truth.contacts), interval, header, names).items():
        yield stamp_ns_of(header), f'ground_truth/{name}', message


def frame_messages(scene, rate: float, frame_id: str, first_ns: int, topic: str,
                   message: Callable[[np.ndarray, Header], object]) -> Iterator[tuple[int, str, object]]:
    """Yield (stamp in ns, topic, message) of all frames of a scene, and of their ground truth.

    rate: Hz; first_ns: stamp of the first frame; message: of what a frame shows, with its header.
    """
    numbers = TouchNumbers()
    for number in range(scene.frames):
        stamp = first_ns + round(number / rate * NS)
        header, (values, truth) = header_of(stamp, frame_id), scene.render(number / rate)
        yield stamp, topic, message(values, header)
        yield from recorded_truth(truth, numbers, 1 / rate, header)


class GroundTruth:
    """The publishers of ground_truth/*; a message is made only if its topic has subscribers."""

    def __init__(self, node: Node):
        self._node, self._publishers, self._numbers = node, {}, TouchNumbers()

    def offer(self, names: Sequence[str]) -> None:
        """Publish these topics, of TRUTH, and no others."""
        for name in self._publishers.keys() - set(names):
            self._node.destroy_publisher(self._publishers.pop(name))
        for name in set(names) - self._publishers.keys():
            self._publishers[name] = self._node.create_publisher(TRUTH[name], f'ground_truth/{name}', _QOS)

    @property
    def wanted(self) -> list[str]:
        """The topics that have subscribers."""
        return [name for name, publisher in self._publishers.items() if publisher.get_subscription_count()]

    @property
    def subscribers(self) -> int:
        """Number of subscriptions to the topics."""
        return sum(publisher.get_subscription_count() for publisher in self._publishers.values())

    def publish_contacts(self, touches: list[Touch], header: Header) -> None:
        """Publish the touches at one instant, the only truth of a sensor without dots."""
        if 'contacts' in self.wanted:
            self._publishers['contacts'].publish(contacts_message(touches, self._numbers.assign(touches), header))

    def publish_recorded(self, truth: RecordedTruth, frame_id: str) -> None:
        """Publish what was recorded, with its stamps, in the sensor frame frame_id."""
        for name, data in truth.messages:
            if name in self.wanted:
                message = deserialize_message(data, TRUTH[name])
                message.header.frame_id = frame_id
                self._publishers[name].publish(message)

    def publish(self, truth: TruthFrame, interval: float, header: Header) -> None:
        """Publish the topics that have subscribers, under the image's header; interval: s between the scene's frames."""
        for name, message in truth_messages(truth, self._numbers.assign(truth.contacts), interval, header, self.wanted).items():
            self._publishers[name].publish(message)

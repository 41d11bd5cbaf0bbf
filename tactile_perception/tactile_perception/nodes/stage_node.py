# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The base of the processing nodes: messages in, results out, and no work while nobody subscribes."""
from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo
from std_srvs.srv import Trigger
from tactile_driver.nodes.runtime.diagnostics import Health, NodeDiagnostics, LogOnce
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.defect_guard import DefectGuard, guard_services
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import STREAM_QOS
from tactile_driver.parameters.table import Parameter

from ..errors import BadArgument, ClockSetBack, TactileError
from .messages.conversions import stamp_ns_of, stamp_seconds
from .shedding import LONGEST_S, Shedding
from .work_log import WorkLog

_PATIENCE_S = 5.0  # that the first message waits for camera_info: chosen; discovery by Fast DDS can take seconds
_STALE_S = 2.0  # without a processed message there is nothing to take as the reference: chosen
#: for images: after a retransmission several arrive at once; chosen
CAMERA_QUEUE = QoSProfile(depth=10)
#: latched: the camera_info from before the subscription counts too
_INFO_QUEUE = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class StageNode(Node):
    """A node that runs one stage.

    make_stage: makes self.stage (nodes/stages) of the parameters' values, before the first subscription. source: (topic, type, QoS) of
    the input; the reliability is that of the publishers. results: topic -> type of the outputs. Subclasses compute the results in
    on_message(message, topics), and set with_camera to False if their stage takes no camera_info. A message that raises a TactileError is
    counted, logged once and skipped; after any other exception the stage begins anew. Raises BadArgument for a parameter that is not
    allowed.
    """

    with_camera = True
    patience_s = LONGEST_S  # longest wait of a message before it is dropped

    def __init__(self, name: str, table: Sequence[Parameter], make_stage: Callable[[dict], object],
                 source: tuple[str, type, QoSProfile], results: dict[str, type], host: Host | None = None):
        self._host = host or Host()
        super().__init__(name, **self._host.options)
        self.settings = NodeParameters(self, table, self.check_change, self._apply_change)
        if self.settings.problems:
            raise BadArgument(f'{name}: ' + '; '.join(self.settings.problems.values()))
        self.diagnostics = NodeDiagnostics(self, name.removesuffix('_node'), self.get_namespace().strip('/') or 'none', self._examine)
        self.stage = make_stage(self.settings.values())
        self._source, self._inputs, self._shedding = source, [], Shedding(self.patience_s)
        self._first_s: float | None = None
        self.log = WorkLog(source[0], by_call=self._host.publishes(self, source[0]))
        self.say, self.net = LogOnce(self), DefectGuard(self)
        matched = PublisherEventCallbacks(matched=lambda _info: self._follow_demand())
        self._outputs = {topic: self._host.publisher(
            self.create_publisher(kind, topic, STREAM_QOS, event_callbacks=matched), self._follow_demand)
            for topic, kind in results.items()}
        guard_services(self)
        self._follow_demand()

    @property
    def wanted(self) -> bool:
        """Whether any result has a subscriber."""
        return bool(self._wanted_topics())

    def _wanted_topics(self) -> list[str]:
        return [topic for topic, publisher in self._outputs.items() if publisher.get_subscription_count()]

    def _follow_demand(self) -> None:
        """Subscribe to the input while a result has a subscriber; unsubscribe otherwise."""
        with self._host.lock:
            if self.wanted and not self._inputs:
                topic, kind, qos = self._source
                self.log.restart_gaps()
                cameras = [self._host.listen(self, CameraInfo, 'camera_info', self._take_camera_info, _INFO_QUEUE)] \
                    if self.with_camera else []
                self._inputs = [*cameras, *self.listen_beside(), self._host.listen(self, kind, topic, self._take, qos)]
            elif not self.wanted and self._inputs:
                for end in self._inputs:
                    end()
                self._inputs = []

    def listen_beside(self) -> list[Callable[[], None]]:
        """Subscribe to what belongs to the input and comes before it; the functions that end it."""
        return []

    def _take_camera_info(self, message: CameraInfo, _received_ns: int) -> None:
        with self._host.lock:
            self.try_to(lambda: self.stage.on_camera_info(message), 'camera_info')

    def _take(self, message, received_ns: int) -> None:
        with self._host.lock:
            self.try_to(lambda: self._process_in_time(message, received_ns), self._source[0])

    def try_to(self, work: Callable[[], None], topic: str) -> None:
        """Process a message; count and report whatever it raises."""
        try:
            work()
        except TactileError as error:
            self._refuse(error)
        except Exception as error:
            if not self.context.ok():  # ROS ends
                raise
            self.log.refuse(self.net.catch(error, topic))
            self.reset_stage()

    def reset_stage(self) -> None:
        """Forget all earlier messages, after a defect."""
        self.stage.begin_anew()

    def _process_in_time(self, message, received_ns: int) -> None:
        stamp_ns = stamp_ns_of(message.header)
        self.log.arrive(stamp_ns, self.covered_ns(message))
        if self._shedding.is_late(stamp_ns, received_ns, time.time_ns()):
            self.log.drop()
        elif not self._is_early():
            self._process(message)

    def _is_early(self) -> bool:
        """Whether the first message still waits for its camera_info."""
        if not self.with_camera or not self.stage.needs_camera:
            return False
        self._first_s = self._first_s or time.monotonic()
        return time.monotonic() - self._first_s < _PATIENCE_S

    def _process(self, message) -> None:
        begin = time.perf_counter()
        topics = self._wanted_topics()
        for topic, result in self.on_message(message, topics).items():
            for part in result if isinstance(result, list) else [result]:
                self._outputs[topic].publish(part)
        latency = 1e-9 * self.get_clock().now().nanoseconds - stamp_seconds(message.header)
        self.log.add(time.perf_counter() - begin, latency)
        self.say.settle('frame')
        if not topics:  # the last subscriber left without an event
            self._follow_demand()

    def _refuse(self, error: TactileError) -> None:
        self.log.refuse(str(error))
        if isinstance(error, ClockSetBack):
            self.get_logger().info(str(error), once=True)  # normal for a recording that plays in a loop
        else:
            self.say.error('frame', f'frame refused: {error}')

    def on_message(self, message, topics: Collection[str]) -> dict[str, object]:
        """Topic -> result of one message, or list of results, for the topics that have a subscriber.

        Raises TactileError for a message that cannot be used.
        """
        raise NotImplementedError

    def covered_ns(self, message) -> int:
        """Duration of the samples of a message, ns; 0 where messages come at a fixed rate."""
        return 0

    def offer_reference(self, take: Callable[[], object]) -> None:
        """Offer the service set_reference; take: called to make the next message the reference."""
        def called(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            """Answer a call."""
            response.success = self.log.done > 0 and self.log.age <= _STALE_S
            if response.success:
                with self._host.lock:
                    take()
                response.message = 'the next messages become the reference; nothing may touch the sensor now'
            else:
                response.message = (f'no {self._source[0]} is being processed: subscribe to {" or ".join(self._outputs)}, and check that '
                                    f'{self._source[0]} is published')
            return response
        self._service = self.create_service(Trigger, 'set_reference', called)

    def check_change(self, changes: dict) -> None:
        """Check changes (name -> new value) of parameters while the node runs. Raises TactileError to refuse them."""

    def _apply_change(self, changes: dict) -> None:
        with self._host.lock:
            self.apply_change(changes)

    def apply_change(self, changes: dict) -> None:
        """Apply changes (name -> new value) of parameters."""

    def remarks(self) -> tuple[str, dict]:
        """A warning ('' for none) and more values, for /diagnostics."""
        return '', {}

    def _examine(self) -> Health:
        with self._host.lock:
            remark, values = self.remarks()
            return self.log.health(not self.wanted, remark, {**values, 'defects met': self.net.caught})

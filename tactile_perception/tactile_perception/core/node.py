# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The node that runs any Stage: messages in, estimates out, and no work while nobody subscribes."""
from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import tactile_driver.nodes  # noqa: F401  sets the number of linear algebra threads, before NumPy is imported

# isort: split
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger

from tactile_driver.frame_names import sensor_frame
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.nodes.runtime.defect_guard import DefectGuard, guard_services
from tactile_driver.nodes.runtime.diagnostics import Health, LogOnce, NodeDiagnostics
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import CAMERA_INFO_PATIENCE_S, STREAM_QOS
from tactile_driver.nodes.runtime.run import exit_process, run_node

from .constants import CORE
from .errors import BadArgument, BadFrame, ClockSetBack, TactileError
from .messages import stamp_seconds
from .sensor_type import NODES
from .stage import Input, Stage
from .work_log import Shedding, WorkLog


class PerceptionNode(Node):
    """Runs one stage of a sensor.

    stage_type: made of the parameters' values. The reliability of a subscription is that of the publishers. A message that raises a
    TactileError is counted, logged once and skipped; after any other exception the stage is reset. Raises BadArgument for a parameter
    that is not allowed.
    """

    def __init__(self, stage_type: type[Stage], host: Host | None = None):
        self._host = host or Host()
        super().__init__(stage_type.node, **self._host.options)
        self.settings = NodeParameters(self, stage_type.parameters, self._check_change, self._change)
        if self.settings.problems:
            raise BadArgument(f'{stage_type.node}: ' + '; '.join(self.settings.problems.values()))
        self.diagnostics = NodeDiagnostics(self, stage_type.node.removesuffix('_node'), self.get_namespace().strip('/') or 'none',
                                           self.examine)
        self.stage = stage_type(self.settings.values())
        self.stage.use_frame(sensor_frame(self.get_namespace()))
        self._source, self._inputs, self._shedding = self.stage.input, [], Shedding(self.stage.input.patience_s or CORE.max_wait_s)
        self._first_s: float | None = None
        self.log = WorkLog(self._source.topic, by_call=self._host.publishes(self, self._source.topic))
        self._log_once, self.guard = LogOnce(self), DefectGuard(self)
        matched = PublisherEventCallbacks(matched=lambda _info: self._follow_demand())
        self.outputs = {topic: self._host.publisher(
            self.create_publisher(kind, topic, STREAM_QOS, event_callbacks=matched), self._follow_demand)
            for topic, kind in self.stage.outputs.items()}
        if self.stage.has_reference:
            self._service = self.create_service(Trigger, 'set_reference', self._set_reference)
        guard_services(self)
        self._follow_demand()

    def _wanted_topics(self) -> list[str]:
        return [topic for topic, publisher in self.outputs.items() if publisher.get_subscription_count()]

    def _follow_demand(self) -> None:
        """Subscribe to the inputs while an output has a subscriber; unsubscribe otherwise."""
        with self._host.lock:
            wanted = bool(self._wanted_topics())
            if wanted and not self._inputs:
                self.log.restart_gaps()
                self._inputs = [self._listen(side, partial(self._take, side.topic)) for side in self.stage.side_inputs]
                self._inputs.append(self._listen(self._source, self._process_in_time, self.log.begin))
            elif not wanted and self._inputs:
                for end in self._inputs:
                    end()
                self._inputs = []

    def _listen(self, source: Input, use: Callable[[object, int], None],
                begin: Callable[[int], None] = lambda _missed: None) -> Callable[[], None]:
        """Call use(message, received_ns) for each message, and begin(number of messages before it) with the first; returns a function that
        ends it."""
        durability = DurabilityPolicy.TRANSIENT_LOCAL if source.latched else DurabilityPolicy.VOLATILE
        return self._host.listen(self, source.type, source.topic, partial(self._guarded, source.topic, use),
                                 QoSProfile(depth=source.depth, durability=durability), begin)

    def _guarded(self, topic: str, use: Callable[[object, int], None], message, received_ns: int) -> None:
        """Use a message; count and report whatever it raises."""
        with self._host.lock:
            try:
                use(message, received_ns)
            except TactileError as error:
                self._refuse(error)
            except Exception as error:
                if not self.context.ok():  # ROS ends
                    raise
                self.log.refuse(self.guard.catch(error, topic))
                self.stage.reset()

    def _take(self, topic: str, message, _received_ns: int) -> None:
        self.stage.take(topic, message)

    def _process_in_time(self, message, received_ns: int) -> None:
        stamp_ns = stamp_ns_of(message.header)
        self.log.arrive(stamp_ns, self.stage.covered_ns(message))
        if self._shedding.is_late(stamp_ns, received_ns, time.time_ns()):
            self.log.drop()
        elif not self._is_early():
            self._process(message)

    def _is_early(self) -> bool:
        """Whether the first message still waits for its camera_info."""
        if not self.stage.waits:
            return False
        self._first_s = self._first_s or time.monotonic()
        return time.monotonic() - self._first_s < CAMERA_INFO_PATIENCE_S

    def _process(self, message) -> None:
        begin = time.perf_counter()
        topics = self._wanted_topics()
        try:
            self._publish(self.stage.process(message, topics))
        except BadFrame as error:
            self._publish(error.partial)
            raise
        latency = 1e-9 * self.get_clock().now().nanoseconds - stamp_seconds(message.header)
        self.log.add(time.perf_counter() - begin, latency)
        self._log_once.settle('frame')
        if not topics:  # the last subscriber left without an event
            self._follow_demand()

    def _publish(self, found: Mapping[str, list]) -> None:
        for topic, results in found.items():
            for result in results:
                self.outputs[topic].publish(result)

    def _refuse(self, error: TactileError) -> None:
        self.log.refuse(str(error))
        if isinstance(error, ClockSetBack):
            self.get_logger().info(str(error), once=True)  # normal for a recording that plays in a loop
        else:
            self._log_once.error('frame', f'frame refused: {error}')

    def _set_reference(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Make the next message the reference."""
        response.success = self.log.done > 0 and self.log.age <= CORE.stale_s
        if response.success:
            with self._host.lock:
                self.stage.set_reference()
            response.message = 'the next messages become the reference; nothing may touch the sensor now'
        else:
            topic = self._source.topic
            response.message = f'every {topic} is refused: {self.log.last_error}' if self.log.refuses else (
                f'no {topic} is being processed: subscribe to {" or ".join(self.outputs)}, and check that {topic} is published')
        return response

    def _check_change(self, changes: dict) -> None:
        self.stage.check_change(self.settings.values() | changes)

    def _change(self, changes: dict) -> None:
        with self._host.lock:
            self.stage.change(self.settings.values() | changes)

    def examine(self) -> Health:
        """For /diagnostics."""
        with self._host.lock:
            if self.log.note:
                self.get_logger().info(self.log.note, once=True)
            warning, values = self.stage.health()
            if warning:
                self._log_once.warning('stage', warning)
            else:
                self._log_once.reset('stage')
            return self.log.health(not self._wanted_topics(), warning, {**values, 'defects met': self.guard.caught})


def make_node(name: str, host: Host | None = None) -> Node:
    """The node of this name, one of sensor_type.NODES. Raises TactileError as it or its stage does."""
    kind = NODES[name]
    return PerceptionNode(kind, host) if issubclass(kind, Stage) else kind(host)


def main(args: list[str] | None = None, node: str = '') -> None:
    """The process of the perception node of this name; '' for that which the executable is named after."""
    exit_process(lambda: run_node(partial(make_node, node or Path(sys.argv[0]).name), args))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""record_node: records all topics of a sensor to a bag (MCAP), whatever ends it and however full the disk is."""
from __future__ import annotations

import math
import os
import time
from pathlib import Path

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2, TimeReference
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from tactile_driver.errors import BadArgument
from tactile_driver.nodes.constants import NODES
from tactile_driver.nodes.messages.conversions import RIGHT_TIME
from tactile_driver.nodes.messages.ground_truth import TRUTH
from tactile_driver.nodes.messages.images import message_type
from tactile_driver.nodes.runtime.defect_guard import guard_services
from tactile_driver.nodes.runtime.diagnostics import ERROR, OK, Health, LogOnce, NodeDiagnostics, common_values
from tactile_driver.nodes.runtime.host import SerializedSubscription
from tactile_driver.nodes.runtime.parameter_server import NodeParameters
from tactile_driver.nodes.runtime.ros_defaults import steady_timer
from tactile_driver.nodes.runtime.run import ends_within, process_of
from tactile_driver.recordings.serialization import type_name_of
from tactile_driver.recordings.writer import AT_ONCE, BagWriter, recorded_qos
from tactile_msgs.msg import DotTracks, PsdVoltages
from tactile_perception.common.messages import RESULTS

from ..parameters.table import RECORD_PARAMETERS
from .constants import BRINGUP

_RESERVE_NAME = 'reserve'


class LiveBag(BagWriter):
    """BagWriter of a running sensor. A message goes to the file at once: a killed process loses the last message, or the last 4 KB.

    A full disk loses the messages of that time: write raises OSError. Space reserved on the disk lets the bag be closed all the same.
    """

    def __init__(self, path: str | Path):
        super().__init__(path, AT_ONCE)

    def __enter__(self) -> LiveBag:
        super().__enter__()
        with open(self.path / _RESERVE_NAME, 'wb') as file:
            os.posix_fallocate(file.fileno(), 0, BRINGUP.reserved_bytes)
        return self

    def __exit__(self, *exc) -> None:
        (self.path / _RESERVE_NAME).unlink(missing_ok=True)
        super().__exit__(*exc)


RAW = {'voltages': PsdVoltages, 'taxels': PointCloud2, RIGHT_TIME: TimeReference,
       **{f'{view}{topic}': kind for view in ('', 'left/', 'right/')
          for topic, kind in (('image_raw', Image), ('camera_info', CameraInfo))}}
ESTIMATES = {'dots': DotTracks, **RESULTS, **{f'ground_truth/{topic}': kind for topic, kind in TRUTH.items()}}
PICTURES = {'markers': MarkerArray, 'image_annotated': Image}

_KEEP_ALL = QoSProfile(history=HistoryPolicy.KEEP_ALL)  # no message of a reliable publisher is lost while the disk keeps up
_LATCHED = QoSProfile(history=HistoryPolicy.KEEP_ALL, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class RecordNode(Node):
    """Writes each message as received with its time of receipt; the bag contains the message definitions."""

    def __init__(self):
        super().__init__('record_node')
        settings = NodeParameters(self, RECORD_PARAMETERS)
        if settings.problems or not settings['bag']:
            raise BadArgument('record_node: ' + ('; '.join(settings.problems.values()) or 'parameter bag is empty; name the bag to write'))
        self._log = LogOnce(self)
        self._begin_s, self._patience_s = time.monotonic(), settings['patience']
        self.written = self._lost = 0
        self._topics: set[str] = set()
        self._last_s, self._problem = math.nan, ''
        self._path = settings['bag']
        self._writer = self._opened()
        for topic, kind in {**ESTIMATES, **(PICTURES if settings['pictures'] else {})}.items():
            self._record(topic, kind)
        self._record('description', String, _LATCHED)
        self._record('/tf_static', TFMessage, _LATCHED)
        self._record('/tf', TFMessage)  # by which, with the next, an array computes friction and frame of its wrench
        self._record('/joint_states', JointState)
        # Subscribe to raw data after the perception nodes: a played recording starts with its first subscriber.
        self._waiting = steady_timer(self, BRINGUP.subscriber_check_s, self._record_raw)
        self._examined = time.monotonic(), 0
        self._diagnostics = NodeDiagnostics(self, 'recording', self._path, self._examine)
        guard_services(self)

    def destroy_node(self) -> None:
        """Write what has arrived, and close the bag, which writes its index."""
        end, idle = time.monotonic() + BRINGUP.max_drain_s, 0
        while self.executor is not None and idle < BRINGUP.idle_callbacks and time.monotonic() < end:
            known = self.written + self._lost
            self.executor.spin_once(timeout_sec=0.0)
            idle = idle + 1 if self.written + self._lost == known else 0
        writer, self._writer = getattr(self, '_writer', None), None
        if writer is not None:
            try:
                writer.__exit__(None, None, None)
            except OSError as error:
                print(f'{self._path}: not closed ({error}); process_bag can read what was written', flush=True)
            print(f'{self._path}: {self.written} messages recorded' + (f', {self._lost} lost' if self._lost else ''), flush=True)
        with ends_within(NODES.max_close_s):  # the middleware hung here or later, once in 44 ends on a busy machine
            super().destroy_node()

    def _opened(self) -> LiveBag:
        try:
            return LiveBag(self._path).__enter__()
        except OSError as error:
            raise BadArgument(f'record_node: bag {self._path} cannot be written: {error}') from error

    def _record_raw(self) -> None:
        if any(self.count_subscribers(topic) for topic in RAW) or time.monotonic() - self._begin_s > self._patience_s:
            self._waiting.cancel()
            for topic, kind in RAW.items():
                self._record(topic, kind)

    def _record(self, topic: str, kind: type, qos: QoSProfile = _KEEP_ALL) -> None:
        name = self.resolve_topic_name(topic)
        type_name = type_name_of(message_type(kind, name))
        SerializedSubscription(self, kind, topic, lambda data, _received_ns: self._write(name, type_name, data), qos)

    def _write(self, topic: str, type_name: str, data: bytes) -> None:
        if self._writer is None:
            return
        if topic not in self._topics:  # the QoS of its publishers is known once the first message has been received
            self._topics.add(topic)
            self._writer.add_topic(topic, type_name, [recorded_qos(each.qos_profile) for each in self.get_publishers_info_by_topic(topic)])
        try:
            self._writer.write(topic, type_name, self.get_clock().now().nanoseconds, data)
        except OSError as error:
            self._lost += 1
            self._problem = f'{topic} could not be recorded: {error}; make room on the disk; the recording then continues by itself'
            self._log.error('write', self._problem)
            return
        if self._problem:
            self.get_logger().info(f'recording continues; {self._lost} messages were lost')
            self._log.reset('write')
        self.written, self._last_s, self._problem = self.written + 1, time.monotonic(), ''

    def _examine(self) -> Health:
        (then, written), self._examined = self._examined, (time.monotonic(), self.written)
        rate = (self.written - written) / max(self._examined[0] - then, 1e-3)
        values = common_values('recording', rate, time.monotonic() - self._last_s, self._lost)
        return Health(ERROR if self._problem else OK, self._problem or f'{self.written} messages recorded', values)


main = process_of(RecordNode)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stream of a taxel array's images: read in one thread, published in another."""
from __future__ import annotations

from dataclasses import replace

from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import String

from ..frame import Frame
from ..matrix import MatrixOrder
from .conversions import header_of, image_to_message
from .ground_truth import GroundTruth
from .image_stream import BaseStream

_DEPTH = 100  # images that wait for a subscriber: a fifth of a second of 500 a second
_ACKNOWLEDGE = Duration(seconds=1)


class TaxelPublishers:
    """image_raw, description (latched) and ground_truth/* of a node; they last as long as the node does."""

    def __init__(self, node: LifecycleNode):
        depth = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=_DEPTH)
        self.image = node.create_lifecycle_publisher(Image, 'image_raw', depth)
        self.description = node.create_publisher(String, 'description', QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.truth = GroundTruth(node)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to images or what comes with them."""
        return bool(self.image.get_subscription_count()) or self.truth.wanted


class TaxelStream(BaseStream):
    """Publishes the frames of source; values: of TAXEL_DRIVER_PARAMETERS."""

    keep = _DEPTH  # slip is told from frame to frame: each counts

    def __init__(self, node: LifecycleNode, publishers: TaxelPublishers, source, values: dict):
        own = values['source'] != 'sim'
        self._order = MatrixOrder(*(own and values[name] for name in ('transposed', 'flip_rows', 'flip_columns')))
        super().__init__(node, publishers, source, values)

    @property
    def remark(self) -> str:
        """What is wrong with frames that come all the same, or do not, ''."""
        return '; '.join(text for text in (self.source.remark, super().remark) if text)

    def _publish(self, frame: Frame) -> None:
        header = header_of(frame.stamp_ns, self._values['frame_id'])
        if self._publishers.image.get_subscription_count():
            frame = replace(frame, image=self._order.ordered(frame.image))
            self._publishers.image.publish(image_to_message(frame, '', header))
        if frame.truth is not None:
            self._publishers.truth.publish(frame.truth, 1 / self.source.describe()['rate'], header)
        if self.source.on_demand:
            self._publishers.image.wait_for_all_acked(_ACKNOWLEDGE)

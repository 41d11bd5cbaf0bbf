# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""force_taxel_node: publishes the vectors of force taxels from a serial port, a topic, a recording or a simulation; a lifecycle node."""
from __future__ import annotations

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float32MultiArray

from ..errors import BadArgument
from ..nodes.driver_node import DriverNode, Stream
from ..nodes.messages.conversions import header_of
from ..nodes.received_messages import ReceivedMessages
from ..nodes.runtime.host import AdaptiveSubscription, Host
from ..nodes.runtime.run import process_of
from ..parameters.drivers import check_together
from ..sources.source import Source
from .constants import FORCE_TAXEL_DRIVER
from .layout import TaxelFrame, read_layout, taxel_frame
from .messages import taxels_to_message
from .parameters import FORCE_TAXEL_DRIVER_PARAMETERS, FORCE_TAXEL_SOURCES


class MultiArraySource(Source):
    """A topic of std_msgs/Float32MultiArray, three numbers a taxel in the order of the layout. Frames are stamped with their time of
    arrival, since the message has none. Raises BadArgument without a topic or layout."""

    live = True

    def __init__(self, node: Node, topic: str, layout: str):
        if not topic:
            raise BadArgument('topic: source topics needs the name of a topic of Float32MultiArray')
        self._node, self._topic, self._layout = node, topic, read_layout(layout)
        self._received = ReceivedMessages(self, FORCE_TAXEL_DRIVER.max_waiting_frames)
        self._subscription: AdaptiveSubscription | None = None

    def open(self) -> None:
        """Subscribe."""
        qos = QoSProfile(depth=FORCE_TAXEL_DRIVER.max_waiting_frames)
        self._subscription = AdaptiveSubscription(self._node, Float32MultiArray, self._topic, self._take, qos)

    def _take(self, message: Float32MultiArray, _received_ns: int) -> None:
        self._received.add((self._node.now_ns(), np.asarray(message.data, float)))

    def read(self, wanted: bool = True) -> TaxelFrame | None:
        """The next frame. Raises NothingYet, or BadFrame for a message of another number of taxels."""
        stamp, numbers = self._received.next()
        return taxel_frame(self._layout, numbers, stamp, f'the message of {self._topic}') if wanted else None

    def close(self) -> None:
        """Unsubscribe."""
        if self._subscription is not None:
            self._subscription.close()
            self._subscription = None

    def describe(self) -> dict:
        """The topic and the number of taxels."""
        return {'path': self._topic, 'rate': -1.0, 'taxels': len(self._layout.positions)}


class ForceTaxelNode(DriverNode):
    """Taxels of one sensor."""

    keep = 100  # slip is estimated from successive frames, none may be lost
    parameters = FORCE_TAXEL_DRIVER_PARAMETERS

    def __init__(self, host: Host | None = None):
        super().__init__('force_taxel_node', self.parameters, 'force taxels', host)
        self.raw = [self.create_lifecycle_publisher(PointCloud2, 'taxels', self.raw_qos)]

    def open_source(self, values: dict) -> Source:
        """See DriverNode."""
        if values['source'] in ('device', 'file', 'topics') and not values['layout']:
            raise BadArgument(f'layout: source {values["source"]} needs the file with the positions of the taxels (docs/force_taxels.md)')
        if values['source'] != 'topics':
            return self.opened(FORCE_TAXEL_SOURCES, values)
        check_together(values)
        source = MultiArraySource(self, values['topic'], values['layout'])
        source.open()
        return source

    def publish(self, stream: Stream, frame: TaxelFrame) -> None:
        """See DriverNode."""
        if self.raw[0].get_subscription_count():
            self.raw[0].publish(taxels_to_message(frame, header_of(frame.stamp_ns, stream.values['frame_id'])), stream.waited_s)
        self.publish_truth(stream, frame.truth, frame.stamp_ns)


main = process_of(ForceTaxelNode)

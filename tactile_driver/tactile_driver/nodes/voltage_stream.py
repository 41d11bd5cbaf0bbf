# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stream of a PSD finger's samples: read in one thread, published in another."""
from __future__ import annotations

from array import array

import numpy as np
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from std_msgs.msg import String
from tactile_msgs.msg import PsdVoltages

from ..samples import SampleBlock
from ..sources.pacing import NS
from .conversions import header_of
from .diagnostics import Health
from .ground_truth import GroundTruth
from .image_stream import BaseStream
from .psd_health import SampleMeter, sample_health

_DEPTH = 100  # messages that wait for a subscriber: half a second of them
_ACKNOWLEDGE = Duration(seconds=1)


class VoltagePublishers:
    """voltages, description (latched) and ground_truth/contacts of a node; they last as long as the node does."""

    def __init__(self, node: LifecycleNode):
        depth = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=_DEPTH)
        self.voltages = node.create_lifecycle_publisher(PsdVoltages, 'voltages', depth)
        self.description = node.create_publisher(String, 'description', QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.truth = GroundTruth(node, ('contacts',))

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes to samples or what comes with them."""
        return bool(self.voltages.get_subscription_count()) or self.truth.wanted


def voltages_message(block: SampleBlock, frame_id: str) -> PsdVoltages:
    """The block as a message."""
    data = array('f')
    data.frombytes(np.ascontiguousarray(block.volts, np.float32).tobytes())
    return PsdVoltages(header=header_of(block.stamp_ns, frame_id), sample_period=float(block.period_s), voltages=data)


class VoltageStream(BaseStream):
    """Publishes the blocks of source; values: of PSD_DRIVER_PARAMETERS."""

    keep = _DEPTH  # every sample counts

    def __init__(self, node: LifecycleNode, publishers: VoltagePublishers, source, values: dict):
        self.meter = SampleMeter(values['saturation'])
        super().__init__(node, publishers, source, values)

    @property
    def remark(self) -> str:
        """What is wrong with samples that come all the same, or do not, ''."""
        return '; '.join(text for text in (self.source.remark, super().remark) if text)

    def health(self) -> Health:
        """For /diagnostics."""
        return sample_health(self.status, self.source.describe(), self.meter, self.source.live, self.remark)

    def _publish(self, block: SampleBlock) -> None:
        self.meter.add(block.volts)
        if self._publishers.voltages.get_subscription_count():
            self._publishers.voltages.publish(voltages_message(block, self._values['frame_id']))
            if self.source.on_demand:
                self._publishers.voltages.wait_for_all_acked(_ACKNOWLEDGE)
        if block.truth is not None and self._publishers.truth.wanted:
            for k in instants(block.truth.touching):
                stamp = block.stamp_ns + (round(k * block.period_s * NS) if k else 0)
                self._publishers.truth.publish_contacts(block.truth.touches(k), header_of(stamp, self._values['frame_id']))


def instants(touching: np.ndarray) -> list[int]:
    """The first sample of a block and those with which contacts begin or end, by how many there are (N,)."""
    return [0, *(np.flatnonzero(np.diff(touching)) + 1).tolist()]

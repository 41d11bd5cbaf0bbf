# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels in rosbag2 recordings: as a source, and simulated scenes as they are recorded."""
from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ..nodes.messages.conversions import stamp_ns_of
from ..nodes.messages.ground_truth import frame_messages
from ..recordings.reader import RawMessage, RecordedTruth
from ..recordings.scenes import SceneWriter
from ..recordings.serialization import decode
from ..simulation.force_taxels.scene import VECTOR_SCENES, VectorScene, open_vector_scene
from ..sources.bag import BagSource
from ..sources.source import Clock
from .layout import TaxelFrame, TaxelLayout, read_layout, taxel_frame
from .messages import taxels_of_message, taxels_to_message
from .sources import simulated_frame

_MULTI_ARRAY = 'std_msgs/msg/Float32MultiArray'
_UPWARDS = np.array([0.0, 0.0, 1.0])


class VectorBagSource(BagSource):
    """A rosbag2 folder or file with clouds as the driver publishes them, or with Float32MultiArray and a layout file."""

    kinds, content = ('sensor_msgs/msg/PointCloud2', _MULTI_ARRAY), 'taxel'

    def __init__(self, values: Mapping, clock: Clock):
        super().__init__(values, clock)
        self._layout: TaxelLayout | None = None

    def open(self) -> None:
        """Open the bag at its start. Raises BadRecording, or BadArgument for a layout that is needed and missing."""
        super().open()
        if self._reader.topics[self._topic] == _MULTI_ARRAY:
            self._layout = read_layout(self._values['layout'])

    def _recorded(self, item: tuple[RawMessage, RecordedTruth | None]) -> tuple[int, tuple]:
        if self._layout is None:
            return super()._recorded(item)
        found, truth = item
        return found.stamp_ns, (decode(found.data, found.type_name), found.stamp_ns, truth)

    def _of_message(self, message, stamp: int, label: str) -> TaxelFrame:
        if self._layout is not None:
            return taxel_frame(self._layout, np.asarray(message.data, float), stamp, label)
        positions, forces, normals = taxels_of_message(message)
        return TaxelFrame(positions, np.tile(_UPWARDS, (len(positions), 1)) if normals is None else normals, forces, stamp)


def _messages(scene: VectorScene, frame_id: str, first_ns: int) -> Iterator[tuple[int, str, object]]:
    """See SceneWriter."""
    return frame_messages(scene, scene.rate, frame_id, first_ns, 'taxels',
                          lambda numbers, header: taxels_to_message(simulated_frame(scene.shape, numbers, stamp_ns_of(header)), header))


SCENES = SceneWriter(VECTOR_SCENES, 100.0, open_vector_scene, _messages, {'surface': (0.0, 0.0, 0.0)})

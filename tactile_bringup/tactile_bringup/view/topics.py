# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which topics of a robot are shown: those of sensors, by their types, and those that give their poses and explain them."""
from __future__ import annotations

from collections.abc import Mapping

#: Of all sensors together.
COMMON = {'/tf': 'tf2_msgs/msg/TFMessage', '/tf_static': 'tf2_msgs/msg/TFMessage', '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray'}
_OF_SENSORS = ('Image', 'CompressedImage', 'PointCloud2', 'WrenchStamped', 'DotTracks', 'ContactRegion', 'Contacts', 'Slip', 'PsdVoltages')


def sensor_topics(topics: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Namespace -> topic -> type of the sensors among topics (topic -> type): a namespace with messages of tactile_msgs is a sensor's."""
    spaces = {topic.rpartition('/')[0] for topic, kind in topics.items()
              if kind.startswith('tactile_msgs/') and '/ground_truth/' not in topic and not topic.startswith('/hand/')}
    return {space: {topic: kind for topic, kind in sorted(topics.items())
                    if topic.rpartition('/')[0] == space and kind.rpartition('/')[2] in _OF_SENSORS}
            for space in sorted(spaces)}

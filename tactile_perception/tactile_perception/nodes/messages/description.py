# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The description of a sensor and its static transforms, with which every recording begins."""
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import yaml
from geometry_msgs.msg import TransformStamped
from std_msgs.msg import String
from tactile_driver.nodes.messages.conversions import header_of
from tf2_msgs.msg import TFMessage

def description_messages(stamp_ns: int, sensor_type: str, frame_id: str, about: Mapping,
                         transforms: Sequence[TransformStamped]) -> Iterator[tuple[int, str, object]]:
    """(stamp, ns, topic, message) of the description, as a driver publishes it, and of /tf_static.

    about: source and what else is known, as plain values; transforms: of the sensor's own frames.
    """
    text = yaml.safe_dump({'sensor_type': sensor_type, 'frame_id': frame_id, **about}, sort_keys=False)
    yield stamp_ns, 'description', String(data=text)
    for transform in transforms:
        transform.header.stamp = header_of(stamp_ns, frame_id).stamp
    yield stamp_ns, '/tf_static', TFMessage(transforms=list(transforms))

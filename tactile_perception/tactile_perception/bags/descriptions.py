# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the sensor descriptions that drivers publish from a recording."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import yaml
from tactile_driver.recordings.description import original

from ..errors import BadFrame
from ..nodes.messages.serialization import MessageCodec
from .rosbag import BagReader


def descriptions(bag: str | Path, namespace: str = '') -> Iterator[dict]:
    """Descriptions in a bag of the sensor in namespace ('': of any sensor); for a replayed sensor the original one.

    Messages without a YAML mapping are skipped. Raises BadRecording.
    """
    codec, end = MessageCodec(), '/description'
    with BagReader(bag) as reader:
        topics = {topic for topic, kind in reader.topics.items()
                  if kind == 'std_msgs/msg/String' and (topic == f'/{namespace}{end}' if namespace else topic.endswith(end))}
        for raw in reader.messages(topics) if topics else ():
            try:
                about = yaml.safe_load(codec.decode(raw.data, raw.type_name).data)
            except (BadFrame, yaml.YAMLError):
                continue
            if isinstance(about, dict):
                yield original(about)

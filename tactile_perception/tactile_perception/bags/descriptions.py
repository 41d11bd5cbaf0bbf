# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads the sensor descriptions that drivers publish from a recording."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import yaml
from tactile_driver.frame_names import sensor_frame
from tactile_driver.recordings.description import original

from ..errors import BadFrame
from ..nodes.messages.serialization import MessageCodec
from .rosbag import BagReader


def descriptions(bag: str | Path, namespace: str = '') -> Iterator[dict]:
    """Descriptions in a bag of the sensor in namespace ('': of any sensor); for a replayed sensor the original one.

    Messages without a YAML mapping are skipped. Raises BadRecording.
    """
    end = '/description'
    with BagReader(bag) as reader:
        topics = {topic for topic in reader.topics if (topic == f'/{namespace}{end}' if namespace else topic.endswith(end))}
        yield from map(original, _mappings(reader, topics))


def recorded_frame(reader: BagReader, prefix: str) -> str:
    """The sensor frame of the sensor with topics under prefix, '/ns/': as its description says, else as its namespace is named."""
    told = (about.get('frame_id') for about in _mappings(reader, {prefix + 'description'}))
    return next((frame for frame in told if frame and isinstance(frame, str)), sensor_frame(prefix))


def _mappings(reader: BagReader, topics: set[str]) -> Iterator[dict]:
    """The YAML mappings in the strings on these topics."""
    codec, topics = MessageCodec(), {topic for topic in topics if reader.topics.get(topic) == 'std_msgs/msg/String'}
    for raw in reader.messages(topics) if topics else ():
        try:
            about = yaml.safe_load(codec.decode(raw.data, raw.type_name).data)
        except (BadFrame, yaml.YAMLError):
            continue
        if isinstance(about, dict):
            yield about

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The description of the sensor in a recording, as its driver published it next to the raw data."""
from __future__ import annotations

import posixpath
from collections.abc import Iterator
from pathlib import Path

import yaml

from ..errors import BadFrame
from ..frame_names import sensor_frame
from .reader import BagReader
from .serialization import decode

_STRING = 'std_msgs/msg/String'


def recorded_description(reader: BagReader, raw_topic: str) -> dict:
    """Description of the sensor with this raw topic: /ns/description for /ns/image_raw or /ns/left/image_raw; {} without one.

    For a recording of a replay, the description in the original recording is returned (see original).
    """
    namespace = posixpath.dirname(raw_topic)
    for folder in (namespace, posixpath.dirname(namespace)):
        for about in _told(reader, {posixpath.join(folder, 'description')}):
            if about:
                return about
    return {}


def descriptions(bag: str | Path, namespace: str = '') -> Iterator[dict]:
    """Descriptions in a bag of the sensor in namespace ('': of any sensor); for a replayed sensor the original one.

    Messages without a YAML mapping are skipped. Raises BadRecording.
    """
    end = '/description'
    with BagReader(bag) as reader:
        yield from _told(reader, {topic for topic in reader.topics
                                  if (topic == f'/{namespace}{end}' if namespace else topic.endswith(end))})


def recorded_frame(reader: BagReader, prefix: str) -> str:
    """The sensor frame of the sensor with topics under prefix, '/ns/': as its description says, else as its namespace is named."""
    told = (about.get('frame_id') for about in _told(reader, {prefix + 'description'}))
    return next((frame for frame in told if frame and isinstance(frame, str)), sensor_frame(prefix))


def original(about: dict) -> dict:
    """Description of the sensor itself: for a replay, the original description, which the driver keeps under the key recorded."""
    recorded = about.get('recorded')
    return recorded if isinstance(recorded, dict) else about


def _told(reader: BagReader, topics: set[str]) -> Iterator[dict]:
    for raw in reader.messages({topic for topic in topics if reader.topics.get(topic) == _STRING}):
        try:
            about = yaml.safe_load(decode(raw.data, _STRING).data)
        except (BadFrame, yaml.YAMLError):
            continue
        if isinstance(about, dict):
            yield original(about)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The description of the sensor in a recording, as its driver published it next to the raw data."""
from __future__ import annotations

import posixpath

import yaml
from rosbags.typesys import Stores, get_typestore

from .reader import BagReader

_STRING = 'std_msgs/msg/String'


def recorded_description(reader: BagReader, raw_topic: str) -> dict:
    """Description of the sensor with this raw topic: /ns/description for /ns/image_raw or /ns/left/image_raw; {} without one.

    For a recording of a replay, the description in the original recording is returned (see original).
    """
    namespace = posixpath.dirname(raw_topic)
    for folder in (namespace, posixpath.dirname(namespace)):
        topic = posixpath.join(folder, 'description')
        for message in reader.messages({topic}) if reader.topics.get(topic) == _STRING else ():
            about = _content(message.data)
            if about:
                return original(about)
    return {}


def original(about: dict) -> dict:
    """Description of the sensor itself: for a replay, the original description, which the driver keeps under the key recorded."""
    recorded = about.get('recorded')
    return recorded if isinstance(recorded, dict) else about


def _content(data: bytes) -> dict:
    """The YAML mapping in a serialised String message; {} if it holds none."""
    try:
        about = yaml.safe_load(get_typestore(Stores.ROS2_JAZZY).deserialize_cdr(data, _STRING).data)
    except Exception:  # damaged CDR data and damaged YAML raise many types
        return {}
    return about if isinstance(about, dict) else {}

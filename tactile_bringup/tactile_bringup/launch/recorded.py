# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads from a recording the bag and the topics of each sensor, and whether it was simulated."""
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tactile_driver.errors import BadArgument
from tactile_driver.frame import COMPRESSED
from tactile_driver.recordings.reader import BagReader, recorded_description
from tactile_perception.core.sensor_type import SENSOR_TYPES


def bag_of(recording: str, namespace: str) -> str:
    """The bag with a sensor's topics: the recording itself, or the bag in it that is named like the sensor frame. Raises BadRecording, and
    BadArgument when it has no topic under that namespace."""
    whole = Path(recording).expanduser()
    own = whole / namespace.replace('/', '_')
    path = own if own.is_dir() else whole
    with BagReader(path) as bag:
        if not any(topic.startswith(f'/{namespace}/') for topic in bag.topics):
            raise BadArgument(f'{path} has no topic under /{namespace}; it has {", ".join(sorted(bag.topics)) or "none"}')
    return str(path)


def recorded_topics(path: str, sensor_type: str, namespace: str, given: Mapping[str, str]) -> tuple[dict[str, str], bool]:
    """The driver parameters that name the topics to play, and whether the sensor was simulated; given: topics that the user names.

    The sensor is that of the given topic, else the one in namespace, else the only one of sensor_type. Without topics of the usual names
    nothing is added: the driver then chooses the topic. Raises BadRecording, and BadArgument for another type of sensor, or for several
    sensors.
    """
    given = {name: topic for name, topic in given.items() if topic}
    with BagReader(Path(path).expanduser()) as bag:
        topics = set(bag.topics)
        described = [topic.removesuffix('description') for topic in topics if topic.endswith('/description')]
        about = {prefix: recorded_description(bag, prefix + 'image_raw') for prefix in described}  # by '/ns/'
    kinds = {prefix: one['sensor_type'] for prefix, one in about.items() if one.get('sensor_type') in SENSOR_TYPES}
    fitting = _fitting(topics, SENSOR_TYPES[sensor_type].raw, given.get('topic', ''), f'/{namespace.strip("/")}/')
    views = [prefix for prefix in fitting if any(prefix != other and prefix.startswith(other) for other in kinds)]
    fitting = [prefix for prefix in fitting if prefix not in views or given]
    others = sorted({kinds[prefix] for prefix in (fitting or kinds) if kinds.get(prefix, sensor_type) != sensor_type})
    fitting = [prefix for prefix in fitting if kinds.get(prefix, sensor_type) == sensor_type]
    if not fitting and others:
        raise BadArgument(f'path:={path} is a recording of {others[0]}, not of {sensor_type}; play it with {others[0]}.launch.py')
    if len(fitting) > 1:
        raise BadArgument(f'path:={path} has several sensors ({", ".join(fitting)}); choose one with namespace:= or topic:=')
    found = {name: prefix + topic for prefix in fitting for name, topic in SENSOR_TYPES[sensor_type].raw.items()}
    return found | given, any(about.get(prefix, {}).get('source') == 'sim' for prefix in fitting)


def _fitting(topics: set[str], raw: Mapping[str, str], given: str, own: str) -> list[str]:
    """'/ns/' of the sensors with these raw topics, of which one is given ('' for none), or in the namespace own."""
    found = sorted(t.removesuffix(raw['topic']) for t in topics if t.endswith('/' + raw['topic']))
    found = [prefix for prefix in found if all(prefix + name in topics for name in raw.values())]
    if given:
        return [prefix for prefix in found if prefix + raw['topic'] == given.removesuffix(COMPRESSED)]
    return [own] if own in found else found

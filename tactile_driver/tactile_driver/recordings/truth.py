# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The ground truth that a recording has beside its raw data."""
from __future__ import annotations

import posixpath
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

_TYPES = {'contacts': 'tactile_msgs/msg/Contacts', 'contact_region': 'tactile_msgs/msg/ContactRegion', 'slip': 'tactile_msgs/msg/Slip',
          'wrench': 'geometry_msgs/msg/WrenchStamped'}


@dataclass(frozen=True)
class RecordedTruth:
    """messages: (name of the topic under ground_truth/, serialised message), as recorded with one raw message."""

    messages: tuple[tuple[str, bytes], ...]


def truth_topics(types: Mapping[str, str], raw_topic: str) -> dict[str, str]:
    """Topic -> its name under ground_truth/, of the sensor with this raw topic: /ns/image_raw, or /ns/left/image_raw; types: of all topics.
    """
    folder = posixpath.dirname(raw_topic)
    named = {posixpath.join(space, 'ground_truth', name): name for space in (folder, posixpath.dirname(folder)) for name in _TYPES}
    return {topic: name for topic, name in named.items() if types.get(topic) == _TYPES[name]}


def with_truth(messages: Iterable, raw_topic: str, topics: Mapping[str, str]) -> Iterator[tuple[object, RecordedTruth | None]]:
    """(raw message, what is recorded of the truth after it and before the next one), in the order of recording; truth before the first raw
    message comes with it. messages: RawMessages of the raw topic and of topics, as of truth_topics."""
    last, found = None, []
    for message in messages:
        if message.topic in topics:
            found.append((topics[message.topic], message.data))
        elif message.topic == raw_topic:
            if last is not None:
                yield last, RecordedTruth(tuple(found)) if found else None
                found = []
            last = message
    if last is not None:
        yield last, RecordedTruth(tuple(found)) if found else None

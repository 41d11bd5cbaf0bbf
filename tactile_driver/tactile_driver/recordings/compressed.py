# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads a bag in which compressed images take the place of raw ones that were not recorded."""
from __future__ import annotations

from collections.abc import Iterator

from ..frame import COMPRESSED
from .reader import BagReader, RawMessage

COMPRESSED_IMAGE = 'sensor_msgs/msg/CompressedImage'


class ImageBagReader(BagReader):
    """A BagReader with image_raw/compressed under the name image_raw, and its own type, if the bag has no image_raw."""

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> message type name."""
        recorded = super().topics
        return {name: recorded[topic] for topic, name in self._names().items()}

    def _names(self) -> dict[str, str]:
        """Recorded topic -> its name here."""
        recorded = super().topics
        plain = {topic: topic.removesuffix(COMPRESSED) for topic, kind in recorded.items() if kind == COMPRESSED_IMAGE}
        return {topic: plain[topic] if plain.get(topic, topic) not in recorded else topic for topic in recorded}

    def count(self, topics: set[str]) -> int:
        """Number of messages of these topics according to the bag's index."""
        return super().count({topic for topic, name in self._names().items() if name in topics})

    def messages(self, topics: set[str] | None = None) -> Iterator[RawMessage]:
        """Messages of the topics (None: all), file by file, in order of recording."""
        names = self._names()
        for raw in super().messages({topic for topic, name in names.items() if topics is None or name in topics}):
            yield raw._replace(topic=names[raw.topic])

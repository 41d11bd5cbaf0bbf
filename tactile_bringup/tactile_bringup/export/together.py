# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of several sensors that were made at the same time, such as those of a hand, read as one."""
from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from itertools import combinations
from pathlib import Path

from tactile_driver.errors import BadRecording
from tactile_driver.recordings.reader import BagReader, LeftOut, RawMessage
from tactile_perception.tools.many import are_many, recordings

#: Endings of topics that are said once, and that each recording of a hand may have.
ATTRIBUTES = 'description', 'camera_info', '/tf_static', 'robot_description'


class HandReader:
    """Reads several recordings as one, with the interface of `BagReader`; use it in a with statement.

    Parameters
    ----------
    path : Path
        Folder of the recordings, for messages.
    bags : iterable of Path
        The recordings.

    Raises
    ------
    BadRecording
        If one of them cannot be read.
    """

    def __init__(self, path: Path, bags: Iterable[Path]):
        self.path, self._stack = path, ExitStack()
        self._readers = [BagReader(bag) for bag in bags]

    def __enter__(self) -> HandReader:
        for reader in self._readers:
            self._stack.enter_context(reader)
        return self

    def __exit__(self, *_exc) -> None:
        self._stack.close()

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> message type name."""
        return {topic: kind for reader in self._readers for topic, kind in reader.topics.items()}

    @property
    def hashes(self) -> dict[str, str]:
        """Topic -> type description hash."""
        return {topic: found for reader in self._readers for topic, found in reader.hashes.items()}

    @property
    def left_out(self) -> LeftOut:
        """What was missing or damaged so far."""
        total = LeftOut()
        for reader in self._readers:
            total.merge(reader.left_out)
        return total

    def count(self, topics: set[str]) -> int:
        """Number of messages of these topics."""
        return sum(reader.count(topics) for reader in self._readers)

    def messages(self, topics: set[str] | None = None) -> Iterator[RawMessage]:
        """Messages of the topics (None: all) in order of recording."""
        return heapq.merge(*(reader.messages(topics) for reader in self._readers), key=lambda message: message.stamp_ns)


def opened(path: Path) -> BagReader | HandReader:
    """The reader of a recording, or of a folder of recordings that belong together."""
    bags = recordings([path])
    return HandReader(path, bags.values()) if are_many(bags, [path]) else BagReader(path)


def joined(found: Mapping[str, Path]) -> dict[str, Path]:
    """Name -> path: a folder replaces its recordings if all of them were found, were made at the same time, and no two share a topic.

    found: names and paths of recordings. Recordings of one sensor, one after the other or of the same time of a simulation, stay separate.
    """
    folders: dict[Path, list[str]] = {}
    for name, path in found.items():
        folders.setdefault(path.parent, []).append(name)
    result = {}
    for folder, names in folders.items():
        bags = [found[name] for name in names]
        if len(bags) > 1 and set(bags) == set(recordings([folder]).values()) and _belong_together(bags):
            result[str(Path(names[0]).parent) if len(Path(names[0]).parts) > 1 else folder.name] = folder
        else:
            result |= {name: found[name] for name in names}
    return result


def _belong_together(bags: list[Path]) -> bool:
    times, topics = [], []
    try:
        for bag in bags:
            with BagReader(bag) as reader:
                times.append(reader.times_ns)
                topics.append({topic for topic in reader.topics if not topic.endswith(ATTRIBUTES)})
    except BadRecording:  # it is said where it is read
        return False
    is_overlapping = max(begin for begin, _ in times) < min(end for _, end in times)
    return is_overlapping and not any(one & other for one, other in combinations(topics, 2))

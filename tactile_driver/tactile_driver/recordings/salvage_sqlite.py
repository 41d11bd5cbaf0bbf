# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads a truncated or damaged sqlite3 bag file as far as possible, because the library rosbags reads only intact files."""
from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from .left_out import LeftOut


class SalvagedSqlite:
    """A truncated or damaged sqlite3 file.

    topics: topic -> type name; definitions: always empty; counts: topic -> number of readable messages. Losses are added to left_out as
    messages are read.
    """

    def __init__(self, path: Path, left_out: LeftOut):
        self.path, self._left_out = path, left_out
        self.topics: dict[str, str] = {}
        self.definitions: dict[str, str] = {}
        self.counts: Counter = Counter()
        for topic, type_name, _, _ in self._scan('NULL', LeftOut()):
            self.topics[topic] = type_name
            self.counts[topic] += 1

    def messages(self, topics: set[str]) -> Iterator[tuple[str, str, int, bytes]]:
        """(topic, type name, time of recording in ns, CDR data) in order of recording."""
        return (found for found in self._scan('data', self._left_out) if found[0] in topics)

    def _scan(self, data: str, left_out: LeftOut) -> Iterator[tuple[str, str, int, bytes]]:
        try:
            with closing(sqlite3.connect(f'{self.path.resolve().as_uri()}?immutable=1', uri=True)) as connection:
                connection.execute('PRAGMA writable_schema = ON')  # otherwise sqlite refuses a file shorter than its header states
                names = {number: (topic, kind) for number, topic, kind in connection.execute('SELECT id, name, type FROM topics')}
                for number, stamp_ns, content in connection.execute(f'SELECT topic_id, timestamp, {data} FROM messages ORDER BY id'):
                    if number in names:
                        yield *names[number], stamp_ns, content
        except sqlite3.Error as error:
            left_out.add(self.path.name, f'the file is cut off or damaged: {error}; what follows is lost')

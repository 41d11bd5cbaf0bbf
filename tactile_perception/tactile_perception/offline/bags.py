# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as rosbag2: raw messages in, raw messages out, in both storages; the container is the library rosbags' work."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer

from ..errors import BadArgument, BadRecording


class RawMessage(NamedTuple):
    """One serialised (CDR) message of a bag; stamp_ns is the time at which it was recorded."""

    topic: str
    type_name: str
    stamp_ns: int
    data: bytes


class BagReader:
    """A rosbag2 folder (or an .mcap or .db3 file in one), opened for reading; use it in a with statement. Raises BadRecording."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        if not self.path.exists():
            raise BadRecording(f'bag {self.path}: no such file or folder')
        folder = self.path if self.path.is_dir() else self.path.parent
        self._reader = AnyReader([folder])

    def __enter__(self) -> BagReader:
        try:
            self._reader.open()
        except Exception as error:  # rosbags raises errors of its own, of zstandard and of sqlite here
            raise BadRecording(f'bag {self.path}: cannot be read: {error}') from error
        return self

    def __exit__(self, *_exc) -> None:
        self._reader.close()

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> message type name."""
        return {c.topic: c.msgtype for c in self._reader.connections}

    def messages(self, topics: set[str] | None = None) -> Iterator[RawMessage]:
        """The messages of the given topics (all when None) in the order of their stamps."""
        chosen = [c for c in self._reader.connections if topics is None or c.topic in topics]
        for connection, stamp, data in self._reader.messages(connections=chosen):
            yield RawMessage(connection.topic, connection.msgtype, stamp, bytes(data))


class BagWriter:
    """Writes a new rosbag2 folder (MCAP); use it in a with statement. The folder must not exist: nothing recorded is overwritten."""

    def __init__(self, path: str | Path, store):
        if Path(path).exists():
            raise BadArgument(f'bag {path}: exists already; choose another name or remove it')
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        self._writer = Writer(Path(path), version=9, storage_plugin=StoragePlugin.MCAP)
        self._store = store
        self._connections = {}

    def __enter__(self) -> BagWriter:
        self._writer.open()
        return self

    def __exit__(self, *_exc) -> None:
        self._writer.close()

    def write(self, topic: str, type_name: str, stamp_ns: int, data: bytes) -> None:
        """Appends one serialised message; type_name such as 'sensor_msgs/msg/Image'."""
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, type_name, typestore=self._store)
        self._writer.write(self._connections[topic], stamp_ns, data)

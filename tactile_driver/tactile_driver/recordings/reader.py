# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads raw messages from rosbag2 recordings, sqlite3 and MCAP, through the library rosbags."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from ..errors import BadRecording
from .left_out import LeftOut
from .storage import StorageFile, bag_files, unpacked


class RawMessage(NamedTuple):
    """One serialised (CDR) message of a bag; stamp_ns: time of recording, ns; message: the decoded message, None if not decoded."""

    topic: str
    type_name: str
    stamp_ns: int
    data: bytes
    message: object = None


class BagReader:
    """Reads a rosbag2 folder, or one .mcap or .db3 file; use it in a with statement. Raises BadRecording if nothing can be read.

    left_out: damaged and missing parts found so far; everything else is read.
    """

    def __init__(self, path: str | Path):
        self.path, self.left_out = Path(path), LeftOut()
        if not self.path.exists():
            raise BadRecording(f'bag {self.path}: no such file or folder')
        self._files: list[StorageFile] = []
        self._stack = ExitStack()

    def __enter__(self) -> BagReader:
        with ExitStack() as stack:
            folder = Path(stack.enter_context(TemporaryDirectory(prefix='unpacked_bag_')))
            files, in_messages = bag_files(self.path, self.left_out)
            for file in files:
                self._files.append(StorageFile(unpacked(file, folder, self.left_out), in_messages, self.left_out))
                stack.callback(self._files[-1].close)
            if not self.topics:
                raise BadRecording(f'bag {self.path}: cannot be read: ' + ('; '.join(self.left_out.lines()) or 'it is empty'))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_exc) -> None:
        self._files = []
        self._stack.close()

    @property
    def topics(self) -> dict[str, str]:
        """Topic -> message type name."""
        return {topic: kind for file in self._files for topic, kind in file.topics.items()}

    @property
    def definitions(self) -> dict[str, str]:
        """Message type name -> its definition in the bag, '' without one."""
        return {kind: text for file in self._files for kind, text in file.definitions.items()}

    def count(self, topics: set[str]) -> int:
        """Number of messages of these topics according to the bag's index."""
        return sum(file.counts[topic] for file in self._files for topic in topics)

    def messages(self, topics: set[str] | None = None) -> Iterator[RawMessage]:
        """Messages of the topics (None: all), file by file, in order of recording."""
        for file in self._files:
            for message in file.messages(set(file.topics) if topics is None else topics):
                yield RawMessage(*message)

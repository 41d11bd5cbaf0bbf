# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The reader, of MCAP by the library mcap."""
from __future__ import annotations

import struct
import sys
from collections import Counter, deque
from collections.abc import Iterator
from pathlib import Path

from mcap.exceptions import EndOfFile, RecordLengthLimitExceeded
from mcap.reader import make_reader
from mcap.records import Channel, Header, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary

from ._storage import BagMetadata, ConverterOptions, MetadataIo, StorageFilter, StorageOptions, TopicInformation, TopicMetadata

Stored = tuple[str, bytes, int]  # topic, message, time of recording in ns


class SequentialReader:
    """Reads a bag's messages in the order of their recording, file by file; a file that has no index, in the order of the file."""

    def __init__(self):
        self._metadata, self._files, self._storage = BagMetadata(), deque(), None
        self._wanted: list[str] = []
        self._messages: Iterator[Stored] = iter(())
        self._waiting: Stored | None = None

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Open a folder with metadata.yaml, or one file."""
        folder = Path(storage_options.uri)
        if MetadataIo().metadata_file_exists(storage_options.uri):
            self._metadata = MetadataIo().read_metadata(storage_options.uri)
            self._files = deque(folder / Path(name).name for name in self._metadata.relative_file_paths)
            self._load_next_file()
        else:
            self._storage = _storage(folder)
            self._metadata = BagMetadata([folder.name], sum(info.message_count for info in self._storage.topics), self._storage.topics)
            self.set_filter(StorageFilter())

    def get_metadata(self) -> BagMetadata:
        """The metadata of the open bag."""
        return self._metadata

    def set_filter(self, storage_filter: StorageFilter) -> None:
        """Read these topics alone, from the beginning of the present file."""
        self._wanted, self._waiting = storage_filter.topics, None
        self._messages = self._storage.messages(self._wanted)

    def has_next(self) -> bool:
        """Whether there is a message left."""
        while self._waiting is None:
            self._waiting = next(self._messages, None)
            if self._waiting is None and not self._files:
                return False
            if self._waiting is None:
                self._load_next_file()
        return True

    def read_next(self) -> Stored:
        """(topic, serialised message, time of recording in ns)."""
        if not self.has_next():
            raise RuntimeError('Bag is at end. No next message.')
        message, self._waiting = self._waiting, None
        return message

    def _load_next_file(self) -> None:
        self._storage = _storage(self._files.popleft())
        self.set_filter(StorageFilter(self._wanted))


class SequentialCompressionReader(SequentialReader):
    """What rosbag2 compressed is not read here."""

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Refuse it."""
        raise RuntimeError(f"{storage_options.uri} is compressed by rosbag2: that needs ROS 2's own rosbag2")


def _storage(path: Path) -> _Mcap:
    try:
        if path.suffix == '.db3':
            raise RuntimeError("sqlite3 needs ROS 2's own rosbag2")
        return _Mcap(path)
    except Exception as error:  # the library raises errors of its own and of struct
        raise RuntimeError(f'No storage could be initialized from the inputs: {path}: {error}') from error


class _Mcap:
    """An MCAP file; one without a summary, as a killed process leaves it, is scanned up to the first record that is not whole."""

    def __init__(self, path: Path):
        self._path = path
        with open(path, 'rb') as file:
            try:
                found = make_reader(file).get_summary()
            except Exception:  # a file that is not finished raises various errors
                found = None
        if found is not None and found.statistics is not None:
            counts = found.statistics.channel_message_counts
        else:
            found, counts = self._scanned()
        self._ordered = any(chunk.message_index_length for chunk in found.chunk_indexes)
        self.topics = [TopicInformation(_topic(channel, found.schemas[channel.schema_id]), counts.get(number, 0))
                       for number, channel in found.channels.items()]

    def messages(self, topics: list[str]) -> Iterator[Stored]:
        """Messages up to the first damage, which is reported on stderr."""
        try:
            if self._ordered:
                with open(self._path, 'rb') as file:
                    for _, channel, message in make_reader(file).iter_messages(topics or None):
                        yield channel.topic, message.data, message.log_time
                return
            names: dict[int, str] = {}
            for record in self._records():
                if isinstance(record, Channel):
                    names[record.id] = record.topic
                elif isinstance(record, Message) and record.channel_id in names and (not topics or names[record.channel_id] in topics):
                    yield names[record.channel_id], record.data, record.log_time
        except Exception as error:  # see _storage
            print(f'[ERROR] [rosbag2_storage_mcap]: {self._path}: {error}', file=sys.stderr)

    def _records(self) -> Iterator[object]:
        with open(self._path, 'rb') as file:
            try:
                yield from StreamReader(file, record_size_limit=self._path.stat().st_size).records
            except (EndOfFile, RecordLengthLimitExceeded, struct.error):
                return

    def _scanned(self) -> tuple[Summary, Counter]:
        summary, counts, records = Summary(), Counter(), self._records()
        if not isinstance(next(records, None), Header):
            raise RuntimeError('the file has no header')
        for record in records:
            if isinstance(record, Schema):
                summary.schemas[record.id] = record
            elif isinstance(record, Channel):
                summary.channels[record.id] = record
            elif isinstance(record, Message):
                counts[record.channel_id] += 1
        return summary, counts


def _topic(channel: Channel, schema: Schema) -> TopicMetadata:
    return TopicMetadata(channel.id, channel.topic, schema.name, channel.message_encoding,
                         type_description_hash=channel.metadata.get('topic_type_hash', ''))

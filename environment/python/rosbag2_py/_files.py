# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""One file of a bag, MCAP or sqlite3, that is read or written."""
from __future__ import annotations

import os
import sqlite3
import struct
import sys
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

from mcap.exceptions import EndOfFile, RecordLengthLimitExceeded
from mcap.reader import make_reader
from mcap.records import Channel, Header, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from mcap.writer import CompressionType, Writer

from ._storage import VERSION, MessageDefinition, TopicInformation, TopicMetadata, qos_text, to_rclcpp_qos_vector

Stored = tuple[str, bytes, int]  # topic, message, time of receipt in ns
_FIRST_NS = -2**63


def _topic(name: str, kind: str, encoding: str, qos: str, type_hash: str, count: int) -> TopicInformation:
    return TopicInformation(TopicMetadata(0, name, kind, encoding, to_rclcpp_qos_vector(qos, VERSION), type_hash), count)


class McapFile:
    """An MCAP file; one without a summary, as a killed process leaves it, is scanned up to the first record that is not whole.

    topics, definitions: what is in it.
    """

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
        self.topics = [_topic(channel.topic, found.schemas[channel.schema_id].name, channel.message_encoding,
                              channel.metadata.get('offered_qos_profiles', ''), channel.metadata.get('topic_type_hash', ''),
                              counts.get(number, 0)) for number, channel in found.channels.items()]
        hashes = {topic.topic_metadata.type: topic.topic_metadata.type_description_hash for topic in self.topics}
        self.definitions = [MessageDefinition(schema.name, schema.encoding, schema.data.decode(), hashes.get(schema.name, ''))
                            for schema in found.schemas.values()]

    def messages(self, topics: Collection[str], start_ns: int = _FIRST_NS) -> Iterator[Stored]:
        """Messages of the topics from a time on, up to the first damage, which is reported on stderr; in order of their times, of a file
        without an index in the order of the file."""
        try:
            if self._ordered:
                with open(self._path, 'rb') as file:
                    for _, channel, message in make_reader(file).iter_messages(topics, starting_at=max(start_ns, 0)):
                        yield channel.topic, message.data, message.log_time
                return
            names: dict[int, str] = {}
            for record in self._records():
                if isinstance(record, Channel):
                    names[record.id] = record.topic
                elif isinstance(record, Message) and names.get(record.channel_id) in topics and record.log_time >= start_ns:
                    yield names[record.channel_id], record.data, record.log_time
        except Exception as error:  # the library raises errors of its own and of struct
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


class SqliteFile:
    """A sqlite3 file; those of older distributions have fewer columns. topics, definitions: what is in it."""

    def __init__(self, path: Path):
        self._path = path
        if not path.is_file():
            raise RuntimeError('no such file')
        with self._opened() as database:
            columns = {name for _, name, *_ in database.execute('PRAGMA table_info(topics)')}
            more = [name if name in columns else "''" for name in ('offered_qos_profiles', 'type_description_hash')]
            rows = database.execute(f'SELECT name, type, serialization_format, {", ".join(more)}, '
                                    '(SELECT count(*) FROM messages WHERE topic_id = topics.id) FROM topics ORDER BY id')
            self.topics = [_topic(*row) for row in rows]
            has_definitions = database.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone()
            definitions = database.execute('SELECT topic_type, encoding, encoded_message_definition, type_description_hash '
                                           'FROM message_definitions ORDER BY id') if has_definitions else ()
            self.definitions = [MessageDefinition(*row) for row in definitions]

    def _opened(self) -> sqlite3.Connection:
        return sqlite3.connect(f'{self._path.absolute().as_uri()}?mode=ro', uri=True)

    def messages(self, topics: Collection[str], start_ns: int = _FIRST_NS) -> Iterator[Stored]:
        """Messages of the topics from a time on, in order of their times."""
        marks = ', '.join('?' * len(topics))
        yield from self._opened().execute('SELECT name, data, timestamp FROM messages JOIN topics ON topic_id = topics.id WHERE timestamp '
                                          f'>= ? AND name IN ({marks}) ORDER BY timestamp, messages.id', [start_ns, *topics])


_BUFFER = 4096  # bytes, as the buffer of a C file: what a killed process loses of a file without chunks


class McapOutput:
    """A new MCAP file. preset: '', fastwrite, zstd_fast or zstd_small."""

    def __init__(self, path: Path, preset: str):
        self._file = open(path, 'xb', buffering=_BUFFER)
        self._writer = Writer(self._file, 1 << 20, CompressionType.ZSTD if preset.startswith('zstd') else CompressionType.NONE,
                              use_chunking=preset != 'fastwrite', enable_crcs=preset not in ('', 'zstd_fast', 'fastwrite'))
        self._writer.start('ros2')
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def add_topic(self, topic: TopicMetadata, definition: MessageDefinition) -> None:
        """Add a topic and the definition of its type."""
        if topic.type not in self._schemas:
            text = definition.encoded_message_definition.encode()
            self._schemas[topic.type] = self._writer.register_schema(topic.type, definition.encoding, text)
        about = {'offered_qos_profiles': qos_text(topic), 'topic_type_hash': topic.type_description_hash}
        self._channels[topic.name] = self._writer.register_channel(topic.name, topic.serialization_format, self._schemas[topic.type], about)

    def write(self, topic: str, message: bytes, received_ns: int, sent_ns: int) -> None:
        """Append a message."""
        self._writer.add_message(self._channels[topic], received_ns, message, sent_ns)

    def finish(self, metadata: str) -> None:
        """Write index and metadata, and close."""
        self._writer.add_metadata('rosbag2', {'serialized_metadata': metadata})
        self._writer.finish()
        self._file.close()


_TABLES = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL,
                    offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
                                 encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""
_SCHEMA = 4  # of these tables


class SqliteOutput:
    """A new sqlite3 file; its messages are on the disk once it is finished."""

    def __init__(self, path: Path, _preset: str):
        self._database, self._topics = sqlite3.connect(path), {}
        self._database.executescript(_TABLES)
        self._database.execute('INSERT INTO schema VALUES (?, ?)', (_SCHEMA, os.environ.get('ROS_DISTRO', '')))

    def add_topic(self, topic: TopicMetadata, definition: MessageDefinition) -> None:
        """Add a topic and the definition of its type."""
        row = topic.name, topic.type, topic.serialization_format, qos_text(topic), topic.type_description_hash
        self._topics[topic.name] = self._database.execute('INSERT INTO topics VALUES (NULL, ?, ?, ?, ?, ?)', row).lastrowid
        if not self._database.execute('SELECT 1 FROM message_definitions WHERE topic_type = ?', (topic.type,)).fetchone():
            self._database.execute('INSERT INTO message_definitions VALUES (NULL, ?, ?, ?, ?)',
                                   (topic.type, definition.encoding, definition.encoded_message_definition, topic.type_description_hash))

    def write(self, topic: str, message: bytes, received_ns: int, _sent_ns: int) -> None:
        """Append a message."""
        self._database.execute('INSERT INTO messages VALUES (NULL, ?, ?, ?)', (self._topics[topic], received_ns, message))

    def finish(self, metadata: str) -> None:
        """Write the metadata, and close."""
        self._database.execute('INSERT INTO metadata VALUES (NULL, ?, ?)', (VERSION, metadata))
        self._database.commit()
        self._database.close()


FILES = {'mcap': McapFile, 'sqlite3': SqliteFile}
OUTPUTS = {'mcap': McapOutput, 'sqlite3': SqliteOutput}

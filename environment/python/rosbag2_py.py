# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2_py where there is no ROS 2: the part of it that this software uses, as of rosbag2 0.26 (Jazzy), with its names and arguments.

It reads and writes MCAP, by the library mcap. A failure is a RuntimeError, as there.
"""
from __future__ import annotations

import os
import re
import struct
import sys
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import yaml
from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from mcap.exceptions import EndOfFile, RecordLengthLimitExceeded
from mcap.reader import make_reader
from mcap.records import Channel, Header, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)  # in C: a bag is opened several times


@dataclass
class StorageOptions:
    """A bag's place. storage_preset_profile, of MCAP: '', fastwrite (no chunks), zstd_fast or zstd_small (compressed chunks)."""

    uri: str
    storage_id: str = ''
    storage_preset_profile: str = field(default='', kw_only=True)


@dataclass
class ConverterOptions:
    """Serialisation formats; nothing is converted."""

    input_serialization_format: str = ''
    output_serialization_format: str = ''


@dataclass
class StorageFilter:
    """Topics to read; all if empty."""

    topics: list[str] = field(default_factory=list)


@dataclass
class TopicMetadata:
    """A topic of a bag; offered_qos_profiles as to_rclcpp_qos_vector makes them."""

    id: int
    name: str
    type: str
    serialization_format: str
    offered_qos_profiles: list = field(default_factory=list)
    type_description_hash: str = ''


@dataclass
class TopicInformation:
    """A topic and the number of its messages."""

    topic_metadata: TopicMetadata
    message_count: int


@dataclass
class BagMetadata:
    """What metadata.yaml or, without one, the file itself says of a bag."""

    relative_file_paths: list[str] = field(default_factory=list)
    message_count: int = 0
    topics_with_message_count: list[TopicInformation] = field(default_factory=list)
    compression_format: str = ''


def to_rclcpp_qos_vector(serialized: str, version: int) -> list:
    """QoS profiles of YAML text; version: of the bag's metadata."""
    return yaml.safe_load(serialized)


class MetadataIo:
    """Reads metadata.yaml."""

    def metadata_file_exists(self, uri: str) -> bool:
        """Whether the folder has one."""
        return Path(uri, 'metadata.yaml').exists()

    def read_metadata(self, uri: str) -> BagMetadata:
        """The metadata of the bag in a folder."""
        try:
            known = yaml.load(Path(uri, 'metadata.yaml').read_text(), _LOADER)['rosbag2_bagfile_information']
            topics = [TopicInformation(TopicMetadata(0, **{'type_description_hash': '', **one['topic_metadata']}), one['message_count'])
                      for one in known['topics_with_message_count']]
            return BagMetadata(known['relative_file_paths'], known['message_count'], topics, known.get('compression_format') or '')
        except (OSError, ValueError, TypeError, KeyError, yaml.YAMLError) as error:
            raise RuntimeError(f'Exception on parsing info file: {error!r}') from error


Stored = tuple[str, bytes, int]  # topic, message, time of recording in ns


class SequentialReader:
    """Reads a bag's messages in the order of their recording, file by file; a file that has no index, in the order of the file."""

    def __init__(self):
        self._metadata, self._files = BagMetadata(), deque()
        self._waiting: Stored | None = None

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Open a folder with metadata.yaml, or one file."""
        folder = Path(storage_options.uri)
        if MetadataIo().metadata_file_exists(storage_options.uri):
            self._metadata = MetadataIo().read_metadata(storage_options.uri)
            self._files = deque(folder / Path(name).name for name in self._metadata.relative_file_paths)
            self._storage = _storage(self._files.popleft())
        else:
            self._storage = _storage(folder)
            self._metadata = BagMetadata([folder.name], sum(info.message_count for info in self._storage.topics), self._storage.topics)
        self.set_filter(StorageFilter())

    def get_metadata(self) -> BagMetadata:
        """The metadata of the open bag."""
        return self._metadata

    def set_filter(self, storage_filter: StorageFilter) -> None:
        """Read these topics alone, from the beginning of the present file."""
        self._filter, self._waiting = storage_filter, None
        self._messages = self._storage.messages(storage_filter.topics)

    def has_next(self) -> bool:
        """Whether there is a message left."""
        while self._waiting is None:
            self._waiting = next(self._messages, None)
            if self._waiting is None and not self._files:
                return False
            if self._waiting is None:
                self._storage = _storage(self._files.popleft())
                self.set_filter(self._filter)
        return True

    def read_next(self) -> Stored:
        """(topic, serialised message, time of recording in ns)."""
        if not self.has_next():
            raise RuntimeError('Bag is at end. No next message.')
        message, self._waiting = self._waiting, None
        return message


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
        self.topics = [
            TopicInformation(TopicMetadata(number, channel.topic, found.schemas[channel.schema_id].name, channel.message_encoding,
                                           type_description_hash=channel.metadata.get('topic_type_hash', '')), counts.get(number, 0))
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


_BUFFER = 4096  # bytes, as the buffer of a C file: what a killed process loses of a file without chunks


class SequentialWriter:
    """Writes a bag to a new folder, with one MCAP file."""

    _writer: McapWriter | None = None

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Make the folder and its file."""
        path, preset = Path(storage_options.uri), storage_options.storage_preset_profile
        if path.is_dir():
            raise RuntimeError(f'Bag directory already exists ({path}), can\'t overwrite existing bag')
        if storage_options.storage_id not in ('', 'mcap'):
            raise RuntimeError(f"storage {storage_options.storage_id} needs ROS 2's own rosbag2")
        self._path, self._name, self._span = path, f'{path.name}_0.mcap', (2**63 - 1, 0)
        self._topics: dict[str, tuple[int, TopicInformation]] = {}
        self._schemas: dict[str, int] = {}
        try:
            path.mkdir(parents=True)
            self._file = open(path / self._name, 'xb', buffering=_BUFFER)
        except OSError as error:
            raise RuntimeError(f'Failed to create bag directory ({path}): {error}') from error
        self._writer = McapWriter(self._file, 1 << 20, CompressionType.ZSTD if preset.startswith('zstd') else CompressionType.NONE,
                                  use_chunking=preset != 'fastwrite', enable_crcs=preset not in ('', 'zstd_fast', 'fastwrite'))
        self._writer.start('ros2')

    def create_topic(self, topic: TopicMetadata) -> None:
        """Add a topic, before its first message; the definition of its type is written, too."""
        if topic.name in self._topics:
            return
        if topic.type not in self._schemas:
            text = _definition(topic.type)
            self._schemas[topic.type] = self._writer.register_schema(topic.type, 'ros2msg' if text else 'unknown', text.encode())
        about = {'offered_qos_profiles': yaml.safe_dump(topic.offered_qos_profiles), 'topic_type_hash': topic.type_description_hash}
        channel = self._writer.register_channel(topic.name, topic.serialization_format, self._schemas[topic.type], about)
        self._topics[topic.name] = channel, TopicInformation(topic, 0)

    def write(self, topic_name: str, message: bytes, time_stamp: int) -> None:
        """Append a serialised message with its time, ns."""
        if topic_name not in self._topics:
            raise RuntimeError(f'Failed to write on topic \'{topic_name}\'. Call create_topic() before first write.')
        channel, information = self._topics[topic_name]
        self._writer.add_message(channel, time_stamp, message, time_stamp)
        information.message_count += 1
        self._span = min(self._span[0], time_stamp), max(self._span[1], time_stamp)

    def close(self) -> None:
        """Write index and metadata."""
        writer, self._writer = self._writer, None
        if writer is None:
            return
        about = self._metadata()
        writer.add_metadata('rosbag2', {'serialized_metadata': yaml.safe_dump(about, sort_keys=False)})
        writer.finish()
        self._file.close()
        (self._path / 'metadata.yaml').write_text(yaml.safe_dump({'rosbag2_bagfile_information': about}, sort_keys=False))

    def __del__(self):
        self.close()

    def _metadata(self) -> dict:
        topics = [asdict(information) for _, information in self._topics.values()]
        for one in topics:
            del one['topic_metadata']['id']
        begin, end = self._span
        time = {'duration': {'nanoseconds': max(end - begin, 0)}, 'starting_time': {'nanoseconds_since_epoch': begin},
                'message_count': sum(one['message_count'] for one in topics)}
        return {'version': 9, 'storage_identifier': 'mcap', **time, 'topics_with_message_count': topics,
                'compression_format': '', 'compression_mode': '', 'relative_file_paths': [self._name],
                'files': [{'path': self._name, **time}], 'custom_data': None, 'ros_distro': os.environ.get('ROS_DISTRO', '')}


_NESTED = re.compile(r'^\s*(?:(\w+)/(?:msg/)?)?([A-Z]\w*)(?:\[.*?\])?\s+\w+', re.MULTILINE)


def _definition(type_name: str) -> str:
    """The definition of a message type (std_msgs/msg/String), followed by those of all types in it; '' if it is not installed."""
    texts, waiting = {}, [tuple(type_name.split('/')[::2])]
    while waiting:
        package, kind = waiting.pop(0)
        if (package, kind) in texts:
            continue
        try:
            text = Path(get_package_share_directory(package), 'msg', f'{kind}.msg').read_text()
        except (OSError, PackageNotFoundError):
            return ''
        texts[package, kind] = text
        waiting += [(other or package, name) for other, name in _NESTED.findall(text)]
    (_, first), *others = texts.items()
    return first + ''.join(f'\n{"=" * 80}\nMSG: {package}/{kind}\n{text}' for (package, kind), text in others)

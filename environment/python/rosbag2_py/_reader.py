# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Reads bags."""
from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import zstandard
from rclpy.duration import Duration
from rclpy.time import Time

from ._files import FILES, McapFile, SqliteFile, Stored
from ._storage import (
    STORAGES,
    BagMetadata,
    ConverterOptions,
    MessageDefinition,
    MetadataIo,
    NeedsRosbag2,
    ReadOrder,
    ReadOrderSortBy,
    StorageFilter,
    StorageOptions,
    TopicInformation,
    TopicMetadata,
    check,
    takes,
)

_PACKED = '.zstd'


def get_registered_readers() -> set[str]:
    """Names of the storages that can be read."""
    return set(STORAGES)


def _storage_of(path: Path) -> str:
    return next((name for name, ending in STORAGES.items() if path.suffix == ending), 'mcap')


def _opened(path: Path) -> McapFile | SqliteFile:
    try:
        return FILES[_storage_of(path)](path)
    except Exception as error:  # the libraries raise errors of their own, and of struct
        raise RuntimeError(f'No storage could be initialized from the inputs: {path}: {error}') from error


def _metadata_of(paths: list[Path]) -> BagMetadata:
    """What the files themselves say of a bag."""
    files, counts, topics, stamps = [_opened(path) for path in paths], Counter(), {}, []
    for file in files:
        for one in file.topics:
            counts[one.topic_metadata.name] += one.message_count
            topics.setdefault(one.topic_metadata.name, one.topic_metadata)
        stamps += [stamp for _, _, stamp in file.messages([one.topic_metadata.name for one in file.topics])]
    begin = min(stamps, default=0)
    return BagMetadata(storage_identifier=_storage_of(paths[0]), relative_file_paths=[path.name for path in paths],
                       bag_size=sum(path.stat().st_size for path in paths), starting_time=Time(nanoseconds=begin),
                       duration=Duration(nanoseconds=max(stamps, default=0) - begin), message_count=sum(counts.values()),
                       topics_with_message_count=[TopicInformation(topic, counts[name]) for name, topic in topics.items()],
                       ros_distro=os.environ.get('ROS_DISTRO', ''))


class SequentialReader:
    """Reads a bag's messages in the order of their receipt, file by file; a file that has no index, in the order of the file."""

    def __init__(self):
        self._metadata: BagMetadata | None = None
        self._filter = StorageFilter()

    def open_uri(self, uri: str) -> None:
        """Open a folder with metadata.yaml, or one file."""
        self.open(StorageOptions(uri), ConverterOptions())

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Open a folder with metadata.yaml, or one file."""
        check(storage_options)
        folder = Path(storage_options.uri)
        if MetadataIo().metadata_file_exists(storage_options.uri):
            metadata = MetadataIo().read_metadata(storage_options.uri)
            self._paths = self._unpacked([folder / Path(name).name for name in metadata.relative_file_paths], metadata)
        else:
            file = _opened(folder)
            metadata = BagMetadata(storage_identifier=_storage_of(folder), relative_file_paths=[folder.name],
                                   message_count=sum(one.message_count for one in file.topics), topics_with_message_count=file.topics,
                                   bag_size=folder.stat().st_size)
            self._paths = [folder]
        self._begin(0)
        self._metadata = metadata

    def _unpacked(self, paths: list[Path], _metadata: BagMetadata) -> list[Path]:
        return paths

    def _begin(self, number: int, start_ns: int = -2**63) -> None:
        """Begin with a file, at a time."""
        self._number, self._start_ns, self._file = number, start_ns, _opened(self._paths[number])
        self._last: Stored | None = None  # message read of this file
        self._restart()

    def _restart(self) -> None:
        """Read on behind the last message, by the present filter."""
        self._next: Stored | None = None
        names = [one.topic_metadata.name for one in self._file.topics]
        wanted = [name for name in names if takes(self._filter, name)]
        if not wanted:
            self._messages = iter(())
        elif self._last is None:
            self._messages = self._file.messages(wanted, self._start_ns)
        else:
            messages = self._file.messages(names, self._last[2])
            for message in messages:
                if message == self._last:
                    break
            self._messages = (message for message in messages if message[0] in wanted)

    def _checked(self) -> BagMetadata:
        if self._metadata is None:
            raise RuntimeError('Bag is not open. Call open() before reading.')
        return self._metadata

    def get_metadata(self) -> BagMetadata:
        """The metadata of the bag."""
        return self._checked()

    def get_all_topics_and_types(self) -> list[TopicMetadata]:
        """The topics of the bag."""
        return [one.topic_metadata for one in self._checked().topics_with_message_count]

    def get_all_message_definitions(self) -> list[MessageDefinition]:
        """The definitions of the message types that the file at hand holds."""
        self._checked()
        return list(self._file.definitions)

    def set_filter(self, storage_filter: StorageFilter) -> None:
        """Read these topics alone from here on."""
        self._checked()
        self._filter = storage_filter
        self._restart()

    def reset_filter(self) -> None:
        """Read all topics from here on."""
        self.set_filter(StorageFilter())

    def set_read_order(self, read_order: ReadOrder) -> bool:
        """Whether messages come in this order; by the time of publishing they do not. Raises NeedsRosbag2 for a reverse order."""
        self._checked()
        if read_order.reverse:
            raise NeedsRosbag2('reading in reverse order')
        return read_order.sort_by != ReadOrderSortBy.PublishedTimestamp

    def seek(self, timestamp: int) -> None:
        """Continue with the first message that was received at this time, ns, or later; the filter stays."""
        self._checked()
        self._begin(0, timestamp)

    def has_next(self) -> bool:
        """Whether there is a message left."""
        self._checked()
        while self._next is None:
            self._next = next(self._messages, None)
            if self._next is None and self._number + 1 == len(self._paths):
                return False
            if self._next is None:
                self._begin(self._number + 1, self._start_ns)
        return True

    def read_next(self) -> Stored:
        """(topic, serialized message, time of receipt in ns)."""
        if not self.has_next():
            raise RuntimeError('Bag is at end. No next message.')
        self._last, self._next = self._next, None
        return self._last


class SequentialCompressionReader(SequentialReader):
    """Reads a bag whose files or messages rosbag2 compressed by zstd."""

    def _unpacked(self, paths: list[Path], metadata: BagMetadata) -> list[Path]:
        if metadata.compression_format not in ('', 'zstd'):
            raise NeedsRosbag2(f'the compression {metadata.compression_format}')
        self._by_message = metadata.compression_mode.upper() == 'MESSAGE'
        if not any(path.suffix == _PACKED for path in paths):
            return paths
        self._folder = TemporaryDirectory(prefix='rosbag2_')
        unpacked = [Path(self._folder.name, path.name).with_suffix('') for path in paths]
        try:
            for source, target in zip(paths, unpacked):
                with open(source, 'rb') as file, open(target, 'wb') as out:
                    zstandard.ZstdDecompressor().copy_stream(file, out)
        except (OSError, zstandard.ZstdError) as error:
            raise RuntimeError(f'{source} cannot be decompressed: {error}') from error
        return unpacked

    def read_next(self) -> Stored:
        """(topic, serialized message, time of receipt in ns)."""
        topic, data, stamp = super().read_next()
        try:
            return topic, zstandard.ZstdDecompressor().decompress(data) if self._by_message else data, stamp
        except zstandard.ZstdError as error:
            raise RuntimeError(f'a message of {topic} cannot be decompressed: {error}') from error


class Info:
    """Tells of a bag."""

    def read_metadata(self, uri: str, storage_id: str) -> BagMetadata:
        """The metadata of a folder, or of one file."""
        check(StorageOptions(uri, storage_id))
        return MetadataIo().read_metadata(uri) if MetadataIo().metadata_file_exists(uri) else _metadata_of([Path(uri)])

    def read_metadata_and_output_service_verbose(self, uri: str, storage_id: str) -> None:
        """Raises NeedsRosbag2."""
        raise NeedsRosbag2('Info.read_metadata_and_output_service_verbose')


class Reindexer:
    """Makes the metadata.yaml of a folder that has lost it."""

    def reindex(self, storage_options: StorageOptions) -> None:
        """Write metadata.yaml by what the folder's files hold, in the order of their numbers."""
        check(storage_options)
        folder = Path(storage_options.uri)
        ending = STORAGES.get(storage_options.storage_id)
        files = [path for path in folder.iterdir() if path.suffix in ([ending] if ending else STORAGES.values())] if folder.is_dir() else []
        if not files:
            raise RuntimeError(f'No storage files found in {folder}')
        files.sort(key=lambda path: [int(part) if part.isdigit() else part for part in re.split(r'(\d+)', path.name)])
        MetadataIo().write_metadata(str(folder), _metadata_of(files))

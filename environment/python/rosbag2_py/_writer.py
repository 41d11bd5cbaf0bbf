# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Writes bags."""
from __future__ import annotations

import os
import sys
from pathlib import Path

import zstandard
from rclpy.duration import Duration
from rclpy.time import Time

from ._definitions import LocalMessageDefinitionSource
from ._files import OUTPUTS
from ._storage import (
    STORAGES,
    BagMetadata,
    CompressionMode,
    CompressionOptions,
    ConverterOptions,
    FileInformation,
    MessageDefinition,
    MetadataIo,
    NeedsRosbag2,
    StorageOptions,
    TopicInformation,
    TopicMetadata,
    check,
    get_default_storage_id,
)


def get_registered_writers() -> set[str]:
    """Names of the storages that can be written."""
    return set(STORAGES)


def get_registered_compressors() -> set[str]:
    """Names of the compressions that can be written."""
    return {'zstd'}


def get_registered_serializers() -> set[str]:
    """Names of the converters between serialization formats: there is none, as where only rosbag2's default ones are installed."""
    return set()


class SequentialWriter:
    """Writes a bag to a new folder."""

    _path: Path | None = None
    _mode = CompressionMode.NONE

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Make the folder and its first file."""
        check(storage_options)
        path = Path(storage_options.uri)
        if path.is_dir():
            raise RuntimeError(f'Bag directory already exists ({path}), can\'t overwrite existing bag')
        self._storage, self._preset = storage_options.storage_id or get_default_storage_id(), storage_options.storage_preset_profile
        self._custom = dict(storage_options.custom_data)
        self._topics: dict[str, tuple[TopicInformation, MessageDefinition]] = {}
        self._files: list[tuple[str, list[int]]] = []  # name; first stamp, last stamp, number of messages
        try:
            path.mkdir(parents=True)
            self._path = path
            self._begin()
        except OSError as error:
            self._path = None
            raise RuntimeError(f'Failed to create bag directory ({path}): {error}') from error

    def _begin(self) -> None:
        name = f'{self._path.name}_{len(self._files)}{STORAGES[self._storage]}'
        self._output = OUTPUTS[self._storage](self._path / name, self._preset)
        self._files.append((name, [2**63 - 1, 0, 0]))
        for information, definition in self._topics.values():
            self._output.add_topic(information.topic_metadata, definition)

    def _finish(self) -> None:
        self._output.finish(MetadataIo().serialize_metadata(self._metadata()))
        if self._mode == CompressionMode.FILE:
            path = self._path / self._files[-1][0]
            with open(path, 'rb') as file, open(f'{path}.zstd', 'wb') as out:
                zstandard.ZstdCompressor().copy_stream(file, out)
            path.unlink()

    def _checked(self) -> None:
        if self._path is None:
            raise RuntimeError('Bag is not open. Call open() before writing.')

    def create_topic(self, topic: TopicMetadata) -> None:
        """Add a topic, before its first message; the definition of its type is written, too. Raises IndexError where that is not
        installed."""
        self._checked()
        if topic.name in self._topics:
            return
        definition = LocalMessageDefinitionSource().get_full_text(topic.type)
        self._output.add_topic(topic, definition)
        self._topics[topic.name] = TopicInformation(topic, 0), definition

    def remove_topic(self, topic: TopicMetadata) -> None:
        """Leave a topic out of the metadata."""
        self._checked()
        self._topics.pop(topic.name, None)

    def write(self, topic_name: str, message: bytes, recv_timestamp: int, send_timestamp: int | None = None) -> None:
        """Append a serialized message with the times of its receipt and of its sending, ns."""
        self._checked()
        if topic_name not in self._topics:
            raise RuntimeError(f'Failed to write on topic \'{topic_name}\'. Call create_topic() before first write.')
        if self._mode == CompressionMode.MESSAGE:
            message = zstandard.ZstdCompressor().compress(message)
        self._output.write(topic_name, message, recv_timestamp, recv_timestamp if send_timestamp is None else send_timestamp)
        self._topics[topic_name][0].message_count += 1
        span = self._files[-1][1]
        span[:] = min(span[0], recv_timestamp), max(span[1], recv_timestamp), span[2] + 1

    def split_bagfile(self) -> None:
        """Go on in another file."""
        self._checked()
        self._finish()
        self._begin()

    def take_snapshot(self) -> bool:
        """False: there is no snapshot mode here."""
        print('[WARN] [rosbag2_py]: take_snapshot called when snapshot mode is disabled', file=sys.stderr)
        return False

    def close(self) -> None:
        """Write index and metadata."""
        if self._path is not None:
            self._finish()
            MetadataIo().write_metadata(str(self._path), self._metadata())
            self._path = None

    def __del__(self):
        self.close()

    def _metadata(self) -> BagMetadata:
        begin, end = min(span[0] for _, span in self._files), max(span[1] for _, span in self._files)
        files = [FileInformation(name, Time(nanoseconds=first), Duration(nanoseconds=max(last - first, 0)), count)
                 for name, (first, last, count) in self._files]
        packed = self._mode != CompressionMode.NONE
        ending = '.zstd' if self._mode == CompressionMode.FILE else ''
        return BagMetadata(storage_identifier=self._storage, relative_file_paths=[name + ending for name, _ in self._files], files=files,
                           duration=Duration(nanoseconds=max(end - begin, 0)), starting_time=Time(nanoseconds=begin),
                           message_count=sum(span[2] for _, span in self._files), custom_data=self._custom,
                           topics_with_message_count=[information for information, _ in self._topics.values()],
                           compression_format='zstd' if packed else '', compression_mode=self._mode.name if packed else '',
                           ros_distro=os.environ.get('ROS_DISTRO', ''))


class SequentialCompressionWriter(SequentialWriter):
    """Writes a bag whose files or messages are compressed by zstd."""

    def __init__(self, compression_options: CompressionOptions | None = None):
        options = compression_options or CompressionOptions()
        if options.compression_format not in ('', *get_registered_compressors()):
            raise NeedsRosbag2(f'the compression {options.compression_format}')
        self._mode = CompressionMode(options.compression_mode)

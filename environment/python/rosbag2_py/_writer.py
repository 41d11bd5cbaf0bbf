# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The writer, of MCAP by the library mcap."""
from __future__ import annotations

import os
from pathlib import Path

import yaml
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from ._definitions import full_text
from ._storage import ConverterOptions, StorageOptions, TopicInformation, TopicMetadata

_BUFFER = 4096  # bytes, as the buffer of a C file: what a killed process loses of a file without chunks


class SequentialWriter:
    """Writes a bag to a new folder."""

    def __init__(self):
        self._writer: _McapBag | None = None

    def open(self, storage_options: StorageOptions, converter_options: ConverterOptions) -> None:
        """Make the folder and its file."""
        path = Path(storage_options.uri)
        if path.is_dir():
            raise RuntimeError(f'Bag directory already exists ({path}), can\'t overwrite existing bag')
        if storage_options.storage_id not in ('', 'mcap'):
            raise RuntimeError(f"storage {storage_options.storage_id} needs ROS 2's own rosbag2")
        try:
            self._writer = _McapBag(path, storage_options.storage_preset_profile)
        except OSError as error:
            raise RuntimeError(f'Failed to create bag directory ({path}): {error}') from error

    def create_topic(self, topic: TopicMetadata) -> None:
        """Add a topic, before its first message; the definition of its type is written, too."""
        if topic.name not in self._writer.topics:
            self._writer.topics[topic.name] = self._writer.added(topic)

    def write(self, topic_name: str, message: bytes, time_stamp: int) -> None:
        """Append a serialised message with its time, ns."""
        if topic_name not in self._writer.topics:
            raise RuntimeError(f'Failed to write on topic \'{topic_name}\'. Call create_topic() before first write.')
        self._writer.write(self._writer.topics[topic_name], message, time_stamp)

    def close(self) -> None:
        """Write index and metadata."""
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def __del__(self):
        self.close()


class _McapBag:
    """A new folder with one MCAP file."""

    def __init__(self, path: Path, preset: str):
        path.mkdir(parents=True)
        self.topics: dict[str, tuple[int, TopicInformation]] = {}
        self._path, self._name, self._schemas, self._span = path, f'{path.name}_0.mcap', {}, (2**63 - 1, 0)
        self._file = open(path / self._name, 'xb', buffering=_BUFFER)
        self._writer = McapWriter(self._file, 1 << 20, CompressionType.ZSTD if preset.startswith('zstd') else CompressionType.NONE,
                                  use_chunking=preset != 'fastwrite', enable_crcs=preset not in ('', 'zstd_fast', 'fastwrite'))
        self._writer.start('ros2')

    def added(self, topic: TopicMetadata) -> tuple[int, TopicInformation]:
        """The channel of a new topic."""
        if topic.type not in self._schemas:
            text = full_text(topic.type)
            self._schemas[topic.type] = self._writer.register_schema(topic.type, 'ros2msg' if text else 'unknown', text.encode())
        about = {'offered_qos_profiles': yaml.safe_dump(topic.offered_qos_profiles), 'topic_type_hash': topic.type_description_hash}
        return (self._writer.register_channel(topic.name, topic.serialization_format, self._schemas[topic.type], about),
                TopicInformation(topic, 0))

    def write(self, topic: tuple[int, TopicInformation], message: bytes, stamp: int) -> None:
        """Append a message."""
        channel, information = topic
        self._writer.add_message(channel, stamp, message, stamp)
        information.message_count += 1
        self._span = min(self._span[0], stamp), max(self._span[1], stamp)

    def close(self) -> None:
        """Write index and metadata."""
        about = self._metadata()
        self._writer.add_metadata('rosbag2', {'serialized_metadata': yaml.safe_dump(about, sort_keys=False)})
        self._writer.finish()
        self._file.close()
        (self._path / 'metadata.yaml').write_text(yaml.safe_dump({'rosbag2_bagfile_information': about}, sort_keys=False))

    def _metadata(self) -> dict:
        topics = [information for _, information in self.topics.values()]
        count, (begin, end) = sum(information.message_count for information in topics), self._span
        time = {'duration': {'nanoseconds': max(end - begin, 0)}, 'starting_time': {'nanoseconds_since_epoch': begin},
                'message_count': count}
        return {'version': 9, 'storage_identifier': 'mcap', **time,
                'topics_with_message_count': [
                    {'topic_metadata': {'name': one.topic_metadata.name, 'type': one.topic_metadata.type,
                                        'serialization_format': one.topic_metadata.serialization_format,
                                        'offered_qos_profiles': one.topic_metadata.offered_qos_profiles,
                                        'type_description_hash': one.topic_metadata.type_description_hash},
                     'message_count': one.message_count} for one in topics],
                'compression_format': '', 'compression_mode': '', 'relative_file_paths': [self._name],
                'files': [{'path': self._name, **time}], 'custom_data': None, 'ros_distro': os.environ.get('ROS_DISTRO', '')}

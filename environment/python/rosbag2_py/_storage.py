# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What describes a bag: options, filter, topics, metadata.yaml."""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import yaml

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
    compression_mode: str = ''


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
            return BagMetadata(known['relative_file_paths'], known['message_count'], topics, known.get('compression_format') or '',
                               known.get('compression_mode') or '')
        except (OSError, ValueError, TypeError, KeyError, yaml.YAMLError) as error:
            raise RuntimeError(f'Exception on parsing info file: {error!r}') from error

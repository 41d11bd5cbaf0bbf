# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Options, filters and metadata of bags."""
from __future__ import annotations

import datetime
import enum
import re
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time

_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)  # in C: a bag is opened several times
VERSION = 9  # of metadata.yaml in Jazzy


class NeedsRosbag2(RuntimeError):
    """Something that only ROS 2's own rosbag2 does."""

    def __init__(self, what: str):
        super().__init__(f"{what} needs ROS 2's own rosbag2, which is not installed; this module of the same name reads and writes bags")


@dataclass
class StorageOptions:
    """A bag. storage_preset_profile, of MCAP: '', fastwrite (no chunks), zstd_fast or zstd_small (compressed chunks)."""

    uri: str
    storage_id: str = ''
    max_bagfile_size: int = 0
    max_bagfile_duration: int = 0
    max_cache_size: int = 0
    storage_preset_profile: str = ''
    storage_config_uri: str = ''
    snapshot_mode: bool = False
    start_time_ns: int = -1
    end_time_ns: int = -1
    custom_data: dict[str, str] = field(default_factory=dict)


def check(options: StorageOptions) -> None:
    """Raises RuntimeError for an unknown storage, and NeedsRosbag2 for an option that has no effect here."""
    if options.storage_id not in ('', *STORAGES):
        raise RuntimeError(f'No storage could be initialized: storage id {options.storage_id!r}; known: {", ".join(STORAGES)}')
    unset = StorageOptions('')
    for name in ('max_bagfile_size', 'max_bagfile_duration', 'storage_config_uri', 'snapshot_mode', 'start_time_ns', 'end_time_ns'):
        if getattr(options, name) != getattr(unset, name):
            raise NeedsRosbag2(f'StorageOptions.{name}')


#: Name of a storage -> ending of its files.
STORAGES = {'mcap': '.mcap', 'sqlite3': '.db3'}


def get_default_storage_id() -> str:
    """The storage of a bag whose options name none."""
    return 'mcap'


@dataclass
class ConverterOptions:
    """Serialization formats; nothing is converted."""

    input_serialization_format: str = ''
    output_serialization_format: str = ''


class CompressionMode(enum.Enum):
    """What rosbag2 compresses."""

    NONE, FILE, MESSAGE = range(3)


def compression_mode_from_string(text: str) -> CompressionMode:
    """NONE for an unknown name, as in rosbag2."""
    return CompressionMode.__members__.get(text.upper(), CompressionMode.NONE)


def compression_mode_to_string(mode: CompressionMode) -> str:
    """The name of a mode."""
    return CompressionMode(mode).name


@dataclass
class CompressionOptions:
    """Compression of a bag that is written; here one thread compresses while a message is written."""

    compression_format: str = ''
    compression_mode: CompressionMode = CompressionMode.NONE
    compression_queue_size: int = 1
    compression_threads: int = 0


@dataclass
class StorageFilter:
    """Topics to read: all where neither topics, services_events nor regex is given. An expression fits whole names."""

    topics: list[str] = field(default_factory=list)
    services_events: list[str] = field(default_factory=list)
    regex: str = ''
    exclude_topics: list[str] = field(default_factory=list)
    exclude_service_events: list[str] = field(default_factory=list)
    regex_to_exclude: str = ''


def takes(wanted: StorageFilter, topic: str) -> bool:
    """Whether a filter lets a topic pass."""
    named, excluded = [*wanted.topics, *wanted.services_events], [*wanted.exclude_topics, *wanted.exclude_service_events]
    taken = topic in named or bool(wanted.regex and re.fullmatch(wanted.regex, topic)) or not (named or wanted.regex)
    return taken and topic not in excluded and not (wanted.regex_to_exclude and re.fullmatch(wanted.regex_to_exclude, topic))


class ReadOrderSortBy(enum.Enum):
    """What messages are sorted by."""

    ReceivedTimestamp, PublishedTimestamp, File = range(3)


@dataclass
class ReadOrder:
    """The order of reading."""

    sort_by: ReadOrderSortBy = ReadOrderSortBy.ReceivedTimestamp
    reverse: bool = False


@dataclass
class MessageDefinition:
    """The text that defines a message type."""

    topic_type: str
    encoding: str
    encoded_message_definition: str
    type_hash: str


_UNSPECIFIED = {'sec': 0, 'nsec': 0}  # RMW_DURATION_UNSPECIFIED
_TIMES = ('deadline', 'lifespan', 'liveliness_lease_duration')
_POLICIES = {'history': HistoryPolicy, 'reliability': ReliabilityPolicy, 'durability': DurabilityPolicy, 'liveliness': LivelinessPolicy}


class QoS:
    """A QoS profile as rclcpp has it; each method returns the profile itself."""

    def __init__(self, history_depth: int):
        self.policies = {'history': 'keep_last', 'depth': history_depth, 'reliability': 'reliable', 'durability': 'volatile',
                         'liveliness': 'system_default', **{name: dict(_UNSPECIFIED) for name in _TIMES},
                         'avoid_ros_namespace_conventions': False}

    def _with(self, **policies) -> QoS:
        self.policies.update(policies)
        return self

    def keep_last(self, depth: int) -> QoS:
        """Keep so many messages."""
        return self._with(history='keep_last', depth=depth)

    def keep_all(self) -> QoS:
        """Keep every message."""
        return self._with(history='keep_all')

    def reliable(self) -> QoS:
        """Repeat what is lost."""
        return self._with(reliability='reliable')

    def best_effort(self) -> QoS:
        """Repeat nothing."""
        return self._with(reliability='best_effort')

    def durability_volatile(self) -> QoS:
        """Keep nothing for later subscribers."""
        return self._with(durability='volatile')

    def transient_local(self) -> QoS:
        """Keep the last messages for later subscribers."""
        return self._with(durability='transient_local')


def to_rclcpp_qos_vector(serialized: str, version: int) -> list[QoS]:
    """QoS profiles of YAML text; version: of the bag's metadata."""
    return [QoS(0)._with(**policies) for policies in yaml.load(serialized, _LOADER) or ()]


def convert_rclcpp_qos_to_rclpy_qos(qos: QoS) -> QoSProfile:
    """The same profile as rclpy has it. Before version 9 of the metadata, policies are numbers."""
    found = {name: kind(value) if isinstance(value := qos.policies[name], int) else kind[value.upper()] for name, kind in _POLICIES.items()}
    times = {name: Duration(seconds=qos.policies[name]['sec'], nanoseconds=qos.policies[name]['nsec']) for name in _TIMES}
    return QoSProfile(depth=qos.policies['depth'], **found, **times,
                      avoid_ros_namespace_conventions=qos.policies['avoid_ros_namespace_conventions'])


@dataclass
class TopicMetadata:
    """A topic of a bag."""

    id: int
    name: str
    type: str
    serialization_format: str
    offered_qos_profiles: list[QoS] = field(default_factory=list)
    type_description_hash: str = ''

    def equals(self, other: TopicMetadata) -> bool:
        """Whether name, type and format are the same."""
        return all(getattr(self, name) == getattr(other, name) for name in ('name', 'type', 'serialization_format'))


@dataclass
class TopicInformation:
    """A topic and the number of its messages."""

    topic_metadata: TopicMetadata
    message_count: int


@dataclass
class FileInformation:
    """A file of a bag."""

    path: str
    starting_time: Time
    duration: Duration | datetime.timedelta
    message_count: int


@dataclass
class BagMetadata:
    """What metadata.yaml or, without one, the file itself says of a bag."""

    version: int = VERSION
    bag_size: int = 0
    storage_identifier: str = ''
    relative_file_paths: list[str] = field(default_factory=list)
    files: list[FileInformation] = field(default_factory=list)
    duration: Duration = field(default_factory=Duration)
    starting_time: Time = field(default_factory=Time)
    message_count: int = 0
    topics_with_message_count: list[TopicInformation] = field(default_factory=list)
    compression_format: str = ''
    compression_mode: str = ''
    custom_data: dict[str, str] = field(default_factory=dict)
    ros_distro: str = ''


def _as_topic(known: dict, version: int) -> TopicInformation:
    about = dict(known['topic_metadata'])
    qos = about.pop('offered_qos_profiles', None) or []
    qos = to_rclcpp_qos_vector(qos if isinstance(qos, str) else yaml.safe_dump(qos), version)
    return TopicInformation(TopicMetadata(0, offered_qos_profiles=qos, **about), known['message_count'])


def _as_metadata(known: dict) -> BagMetadata:
    times = {'duration': Duration(nanoseconds=known['duration']['nanoseconds']),
             'starting_time': Time(nanoseconds=known['starting_time']['nanoseconds_since_epoch'])}
    files = [FileInformation(one['path'], Time(nanoseconds=one['starting_time']['nanoseconds_since_epoch']),
                             datetime.timedelta(microseconds=one['duration']['nanoseconds'] // 1000), one['message_count'])
             for one in known.get('files') or ()]
    plain = {name: known.get(name) or '' for name in ('storage_identifier', 'compression_format', 'compression_mode', 'ros_distro')}
    return BagMetadata(version=known['version'], relative_file_paths=known['relative_file_paths'], files=files,
                       message_count=known['message_count'], custom_data=known.get('custom_data') or {}, **plain, **times,
                       topics_with_message_count=[_as_topic(one, known['version']) for one in known['topics_with_message_count']])


def _span(about: BagMetadata | FileInformation) -> dict:
    duration = about.duration
    nanoseconds = duration.nanoseconds if isinstance(duration, Duration) else duration // datetime.timedelta(microseconds=1) * 1000
    return {'duration': {'nanoseconds': nanoseconds}, 'starting_time': {'nanoseconds_since_epoch': about.starting_time.nanoseconds},
            'message_count': about.message_count}


def qos_text(topic: TopicMetadata) -> str:
    """The offered profiles as YAML."""
    return yaml.safe_dump([qos.policies for qos in topic.offered_qos_profiles], sort_keys=False)


def _as_yaml(metadata: BagMetadata) -> dict:
    topics = [{'topic_metadata': {'name': topic.name, 'type': topic.type, 'serialization_format': topic.serialization_format,
                                  'offered_qos_profiles': [qos.policies for qos in topic.offered_qos_profiles],
                                  'type_description_hash': topic.type_description_hash}, 'message_count': information.message_count}
              for information in metadata.topics_with_message_count for topic in (information.topic_metadata,)]
    return {'version': metadata.version, 'storage_identifier': metadata.storage_identifier, **_span(metadata),
            'topics_with_message_count': topics, 'compression_format': metadata.compression_format,
            'compression_mode': metadata.compression_mode, 'relative_file_paths': metadata.relative_file_paths,
            'files': [{'path': file.path, **_span(file)} for file in metadata.files], 'custom_data': metadata.custom_data or None,
            'ros_distro': metadata.ros_distro}


class MetadataIo:
    """Reads and writes metadata.yaml."""

    def metadata_file_exists(self, uri: str) -> bool:
        """Whether the folder has one."""
        return Path(uri, 'metadata.yaml').exists()

    def read_metadata(self, uri: str) -> BagMetadata:
        """The metadata of the bag in a folder."""
        try:
            found = _as_metadata(yaml.load(Path(uri, 'metadata.yaml').read_text(), _LOADER)['rosbag2_bagfile_information'])
        except (OSError, ValueError, TypeError, KeyError, AttributeError, yaml.YAMLError) as error:
            raise RuntimeError(f'Exception on parsing info file: {error!r}') from error
        files = (Path(uri, Path(name).name) for name in found.relative_file_paths)
        found.bag_size = sum(file.stat().st_size for file in files if file.is_file())
        return found

    def write_metadata(self, uri: str, metadata: BagMetadata) -> None:
        """Write metadata.yaml into a folder."""
        Path(uri, 'metadata.yaml').write_text(yaml.safe_dump({'rosbag2_bagfile_information': _as_yaml(metadata)}, sort_keys=False))

    def serialize_metadata(self, metadata: BagMetadata) -> str:
        """The metadata as YAML."""
        return yaml.safe_dump(_as_yaml(metadata), sort_keys=False)

    def deserialize_metadata(self, text: str) -> BagMetadata:
        """The metadata that YAML holds."""
        try:
            return _as_metadata(yaml.load(text, _LOADER))
        except (ValueError, TypeError, KeyError, AttributeError, yaml.YAMLError) as error:
            raise RuntimeError(f'Exception on parsing metadata: {error!r}') from error

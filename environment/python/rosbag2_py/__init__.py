# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2_py where there is no ROS 2: names, arguments and behaviour of rosbag2 0.26 (Jazzy).

It reads and writes MCAP, by the library mcap, and sqlite3, compressed by rosbag2 or not. A failure is a RuntimeError, as there. What needs
rosbag2's C++ nodes, playing, recording and rewriting, raises NeedsRosbag2, also a RuntimeError.
"""
from ._definitions import LocalMessageDefinitionSource
from ._reader import Info, Reindexer, SequentialCompressionReader, SequentialReader, get_registered_readers
from ._storage import (
    BagMetadata,
    CompressionMode,
    CompressionOptions,
    ConverterOptions,
    FileInformation,
    MessageDefinition,
    MetadataIo,
    NeedsRosbag2,
    ReadOrder,
    ReadOrderSortBy,
    StorageFilter,
    StorageOptions,
    TopicInformation,
    TopicMetadata,
    compression_mode_from_string,
    compression_mode_to_string,
    convert_rclcpp_qos_to_rclpy_qos,
    get_default_storage_id,
    to_rclcpp_qos_vector,
)
from ._writer import (
    SequentialCompressionWriter,
    SequentialWriter,
    get_registered_compressors,
    get_registered_serializers,
    get_registered_writers,
)


def _refused(name: str) -> type:
    def refuse(_self, *_words, **_named):
        raise NeedsRosbag2(f'rosbag2_py.{name}')
    return type(name, (), {'__init__': refuse, '__doc__': f'Not here: {name}() raises NeedsRosbag2.'})


Player, PlayOptions, Recorder, RecordOptions = (_refused(name) for name in ('Player', 'PlayOptions', 'Recorder', 'RecordOptions'))
ServiceRequestsSource, bag_rewrite = _refused('ServiceRequestsSource'), _refused('bag_rewrite')

__all__ = [
    'BagMetadata', 'CompressionMode', 'CompressionOptions', 'ConverterOptions', 'FileInformation', 'Info', 'LocalMessageDefinitionSource',
    'MessageDefinition', 'MetadataIo', 'PlayOptions', 'Player', 'ReadOrder', 'ReadOrderSortBy', 'RecordOptions', 'Recorder', 'Reindexer',
    'SequentialCompressionReader', 'SequentialCompressionWriter', 'SequentialReader', 'SequentialWriter', 'ServiceRequestsSource',
    'StorageFilter', 'StorageOptions', 'TopicInformation', 'TopicMetadata', 'bag_rewrite', 'compression_mode_from_string',
    'compression_mode_to_string', 'convert_rclcpp_qos_to_rclpy_qos', 'get_default_storage_id', 'get_registered_compressors',
    'get_registered_readers', 'get_registered_serializers', 'get_registered_writers', 'to_rclcpp_qos_vector']

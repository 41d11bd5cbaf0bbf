# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2_py where there is no ROS 2: the part of it that this software uses, as of rosbag2 0.26 (Jazzy), with its names and arguments.

It reads and writes MCAP. A failure is a RuntimeError, as there.
"""
from ._reader import SequentialCompressionReader, SequentialReader
from ._storage import (BagMetadata, ConverterOptions, MetadataIo, StorageFilter, StorageOptions, TopicInformation, TopicMetadata,
                       to_rclcpp_qos_vector)
from ._writer import SequentialWriter

__all__ = ['BagMetadata', 'ConverterOptions', 'MetadataIo', 'SequentialCompressionReader', 'SequentialReader', 'SequentialWriter',
           'StorageFilter', 'StorageOptions', 'TopicInformation', 'TopicMetadata', 'to_rclcpp_qos_vector']

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags are written once, read back byte by byte, in both storages, compressed or not; what is no bag is named."""
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from tactile_perception.errors import BadArgument, BadRecording
from tactile_perception.offline.bags import BagReader, BagWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
STRING = STORE.types['std_msgs/msg/String']


def encoded(text):
    return bytes(STORE.serialize_cdr(STRING(data=text), 'std_msgs/msg/String'))


def test_messages_come_back_in_the_order_of_their_stamps(tmp_path):
    with BagWriter(tmp_path / 'bag', STORE) as writer:
        for stamp, topic in ((30, '/b'), (10, '/a'), (20, '/b')):
            writer.write(topic, 'std_msgs/msg/String', stamp, encoded(f'{topic} {stamp}'))
    with BagReader(tmp_path / 'bag') as reader:
        assert reader.topics == {'/a': 'std_msgs/msg/String', '/b': 'std_msgs/msg/String'}
        assert [(m.topic, m.stamp_ns, m.data) for m in reader.messages()] == [
            (t, s, encoded(f'{t} {s}')) for t, s in (('/a', 10), ('/b', 20), ('/b', 30))
        ]
        assert [m.stamp_ns for m in reader.messages({'/b'})] == [20, 30]


@pytest.mark.parametrize('storage', [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize('zstd', [False, True])
def test_reads_both_storages_compressed_or_not(tmp_path, storage, zstd):
    writer = Writer(tmp_path / 'bag', version=9, storage_plugin=storage)
    if zstd:
        writer.set_compression(
            CompressionMode.MESSAGE if storage is StoragePlugin.SQLITE3 else CompressionMode.STORAGE, CompressionFormat.ZSTD
        )
    with writer:
        connection = writer.add_connection('/a', 'std_msgs/msg/String', typestore=STORE)
        writer.write(connection, 5, encoded('x'))
    with BagReader(tmp_path / 'bag') as reader:
        assert [(m.stamp_ns, m.data) for m in reader.messages()] == [(5, encoded('x'))]


def test_nothing_recorded_is_overwritten(tmp_path):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(BadArgument, match='exists already'):
        BagWriter(tmp_path / 'bag', STORE)


def test_a_missing_and_a_broken_bag_are_named(tmp_path):
    with pytest.raises(BadRecording, match='no such file'):
        BagReader(tmp_path / 'none')
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'metadata.yaml').write_text('rosbag2_bagfile_information: 3')
    with pytest.raises(BadRecording, match='cannot be read'):
        with BagReader(tmp_path / 'bag'):
            pass

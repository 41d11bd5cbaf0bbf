# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tactile_driver.errors import BadFrame, BadRecording
from tactile_driver.sources.base.protocol import EndOfSource
from tactile_driver.sources.psd.bag import PsdBagSource

STORE = get_typestore(Stores.ROS2_JAZZY)
NAME = 'tactile_msgs/msg/PsdVoltages'
STORE.register(get_types_from_msg('std_msgs/Header header\nfloat64 sample_period\nfloat32[] voltages\n', NAME))


def write(path, counts):
    """A bag of messages with so many voltages each."""
    header, time = STORE.types['std_msgs/msg/Header'], STORE.types['builtin_interfaces/msg/Time']
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/finger/voltages', NAME, typestore=STORE)
        for k, count in enumerate(counts):
            message = STORE.types[NAME](header(time(5, 1000 * k), 'finger'), 2e-4, np.arange(count, dtype=np.float32))
            writer.write(connection, 5 * 10**9 + 1000 * k, STORE.serialize_cdr(message, NAME))
    return path


def test_voltages_keep_their_stamps(tmp_path):
    source = PsdBagSource(str(write(tmp_path / 'bag', [8, 3, 12])), '', 0.0, False)
    source.open()
    first = source.read()
    assert (first.stamp_ns, first.period_s, first.volts.tolist()) == (5 * 10**9, 2e-4, [[0, 1, 2, 3], [4, 5, 6, 7]])
    with pytest.raises(BadFrame, match='a sample has four'):
        source.read()
    assert source.read().volts.shape == (3, 4)
    with pytest.raises(EndOfSource):
        source.read()


def test_a_topic_without_voltages(tmp_path):
    source = PsdBagSource(str(write(tmp_path / 'bag', [4])), 'image_raw', 0.0, False)
    with pytest.raises(BadRecording, match='voltage topics: /finger/voltages'):
        source.open()

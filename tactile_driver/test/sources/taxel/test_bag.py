# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from tactile_driver.errors import BadFrame
from tactile_driver.sources.base.protocol import EndOfSource
from tactile_driver.sources.taxel.bag import TaxelBagSource

STORE = get_typestore(Stores.ROS2_JAZZY)


def bag_of(path, images):
    kinds = STORE.types
    header, time = kinds['std_msgs/msg/Header'], kinds['builtin_interfaces/msg/Time']
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection('/pad/image_raw', 'sensor_msgs/msg/Image', typestore=STORE)
        for k, (values, encoding) in enumerate(images):
            data = np.frombuffer(values.tobytes(), np.uint8)
            message = kinds['sensor_msgs/msg/Image'](header(time(1 + k, 0), 'pad'), *values.shape, encoding, 0, values.strides[0], data)
            writer.write(topic, (1 + k) * 10**9, STORE.serialize_cdr(message, 'sensor_msgs/msg/Image'))
    return path


def test_all_bits_and_stamps_come_back(tmp_path):
    wide = np.array([[1, 1000, 65535], [0, 256, 4095]], np.uint16)
    source = TaxelBagSource(bag_of(tmp_path / 'b', [(wide, 'mono16'), (wide.astype(np.uint8), 'mono8')]), '', 0, False, (2, 3))
    source.open()
    frames = [source.read(), source.read()]
    assert frames[0].image.tolist() == wide.tolist() and [frame.encoding for frame in frames] == ['mono16', 'mono8']
    assert [frame.stamp_ns for frame in frames] == [10**9, 2 * 10**9]
    with pytest.raises(EndOfSource):
        source.read()
    source.close()


def test_colour_and_other_sizes_are_skipped(tmp_path):
    source = TaxelBagSource(bag_of(tmp_path / 'b', [(np.zeros((2, 9), np.uint8), 'bgr8'), (np.zeros((3, 3), np.uint8), 'mono8')]), '', 0,
                            False, (2, 3))
    source.open()
    for reason in ('encoding .bgr8. is not supported', 'it is skipped'):
        with pytest.raises(BadFrame, match=reason):
            source.read()
    source.close()

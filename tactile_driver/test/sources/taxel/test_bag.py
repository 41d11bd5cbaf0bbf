# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from sensor_msgs.msg import Image
from tactile_driver.errors import BadFrame
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.recordings.writer import write_messages
from tactile_driver.sources.bag import TaxelBagSource
from tactile_driver.sources.source import EndOfSource


def bag_of(path, images):
    """A bag of (values, encoding), one a second."""
    write_messages(path, 'pad', ((10**9 * k, 'image_raw', Image(
        header=header_of(10**9 * k, 'pad'), height=values.shape[0], width=values.shape[1], encoding=encoding, step=values.strides[0],
        data=values.tobytes())) for k, (values, encoding) in enumerate(images, 1)))
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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags are written once and read back byte by byte."""
import pytest
from string_messages import STORE, TYPE, encoded
from tactile_perception.bags.rosbag import BagReader, BagWriter
from tactile_perception.errors import BadArgument


def test_messages_come_back_in_the_order_of_their_stamps(tmp_path):
    with BagWriter(tmp_path / 'bag', STORE) as writer:
        for stamp, topic in ((30, '/b'), (10, '/a'), (20, '/b')):
            writer.write(topic, TYPE, stamp, encoded(f'{topic} {stamp}'))
    with BagReader(tmp_path / 'bag') as reader:
        assert reader.topics == {'/a': TYPE, '/b': TYPE}
        assert [(m.topic, m.stamp_ns, m.data) for m in reader.messages()] == [
            (t, s, encoded(f'{t} {s}')) for t, s in (('/a', 10), ('/b', 20), ('/b', 30))
        ]
        assert [m.stamp_ns for m in reader.messages({'/b'})] == [20, 30]


def test_nothing_recorded_is_overwritten(tmp_path):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(BadArgument, match='exists'):
        BagWriter(tmp_path / 'bag', STORE)


def test_a_compressed_bag_is_small_and_holds_the_same(tmp_path):
    sizes = {}
    for compressed in (False, True):
        path = tmp_path / str(compressed)
        with BagWriter(path, STORE, compressed) as writer:
            for k in range(200):
                writer.write('/words', TYPE, k, encoded(f'{k} ' + 500 * 'all alike '))
        with BagReader(path) as reader:
            assert [m.data for m in reader.messages()] == [encoded(f'{k} ' + 500 * 'all alike ') for k in range(200)]
            assert not reader.left_out.total
        sizes[compressed] = sum(file.stat().st_size for file in path.iterdir())
    assert sizes[True] < 0.2 * sizes[False]

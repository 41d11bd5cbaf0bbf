# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each part is a recording by itself as soon as it is ended; parts make one bag, and what was not ended is no part of it."""
import pytest
import yaml
from rosbags.rosbag2 import Reader
from small_bags import STORE, TYPE, message, numbers
from tactile_perception.offline.bags import BagReader
from tactile_perception.offline.part_writer import UNFINISHED, PartWriter


@pytest.fixture
def bag(tmp_path):
    """Two ended parts of two messages, on /a and /b, and one that is not."""
    writer = PartWriter(tmp_path / 'bag', STORE)
    for k in range(5):
        writer.write('/ab'[0] + 'ab'[k == 3], TYPE, 10 + k, message(k, 1000))
        if k in (1, 3):
            writer.end_part()
            writer.end_part()  # nothing new: no part
    return tmp_path / 'bag', writer


def test_ended_parts_are_one_bag_for_any_reader(bag):
    path, writer = bag
    assert writer.parts == 2 and sorted(f.name for f in path.iterdir()) == ['bag_0.mcap', 'bag_1.mcap', 'metadata.yaml', UNFINISHED]
    with BagReader(path) as reader:
        assert numbers(m.data for m in reader.messages()) == [0, 1, 2, 3] and reader.left_out.total == 0
    with Reader(path) as reader:
        assert (reader.message_count, reader.start_time, reader.end_time) == (4, 10, 14)
        assert {c.topic: c.msgcount for c in reader.connections} == {'/a': 3, '/b': 1}
    with Reader(path / 'bag_1.mcap') as reader:
        assert [stamp for _, stamp, _ in reader.messages()] == [12, 13]


def test_metadata_tells_of_each_file(bag):
    page = yaml.safe_load((bag[0] / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert [(f['path'], f['message_count'], f['starting_time']['nanoseconds_since_epoch']) for f in page['files']] == [
        ('bag_0.mcap', 2, 10), ('bag_1.mcap', 2, 12)]
    assert page['duration'] == {'nanoseconds': 3} and page['storage_identifier'] == 'mcap' and page['version'] == 9


def test_a_later_writer_goes_on_after_the_parts_that_it_is_given(bag):
    path, writer = bag
    first = dict(writer.metadata)
    later = PartWriter(path, STORE, {**first, 'relative_file_paths': ['bag_0.mcap'], 'files': first['files'][:1], 'message_count': 2})
    assert sorted(f.name for f in path.glob('*.mcap')) == ['bag_0.mcap']
    later.write('/a', TYPE, 30, message(7, 1000))
    later.end_part()
    with BagReader(path) as reader:
        assert numbers(m.data for m in reader.messages()) == [0, 1, 7]


def test_without_an_ended_part_there_is_no_metadata_but_what_there_is_can_be_read(tmp_path):
    writer = PartWriter(tmp_path / 'bag', STORE)
    for k in range(5):
        writer.write('/a', TYPE, k, message(k))  # more than a chunk, which is on the disk
    writer._writer.storage.bio.flush()
    assert not (tmp_path / 'bag' / 'metadata.yaml').exists()
    with BagReader(tmp_path / 'bag') as reader:
        assert numbers(m.data for m in reader.messages()) == [0, 1, 2, 3] and reader.left_out.total > 0

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bags are read byte by byte, in both storages, compressed or not; what is no bag is named."""
import pytest
from small_bags import FILE, MCAP, MESSAGE, NONE, SQLITE, STORAGE, TYPE, message, numbers, write_bag

from tactile_driver.errors import BadRecording
from tactile_driver.recordings.reader import BagReader


@pytest.mark.parametrize('storage, compression', [(MCAP, NONE), (MCAP, STORAGE), (MCAP, MESSAGE), (MCAP, FILE), (SQLITE, NONE),
                                                  (SQLITE, MESSAGE), (SQLITE, FILE)])
def test_reads_both_storages_compressed_or_not(tmp_path, storage, compression):
    write_bag(tmp_path / 'bag', 3, storage, compression, size=1000)
    with BagReader(tmp_path / 'bag') as reader:
        assert reader.topics == {'/a': TYPE} and reader.count({'/a'}) == 3 and reader.left_out.total == 0
        assert 'string data' in reader.definitions[TYPE]
        assert [(m.topic, m.type_name, m.stamp_ns, m.data) for m in reader.messages()] == [
            ('/a', TYPE, 10 * (k + 1), message(k, 1000)) for k in range(3)]


def test_a_bag_of_several_files_is_read_one_after_the_other_and_one_file_alone(tmp_path):
    bag = tmp_path / 'bag'
    for part in range(3):
        file = write_bag(tmp_path / f'part_{part}', 2, size=1000, first=2 * part)
        bag.mkdir(exist_ok=True)
        file.rename(bag / f'bag_{part}.mcap')
    with BagReader(bag) as reader:
        assert numbers(m.data for m in reader.messages()) == [0, 1, 2, 3, 4, 5] and reader.count({'/a'}) == 6
    with BagReader(bag / 'bag_1.mcap') as reader:
        assert numbers(m.data for m in reader.messages({'/a'})) == [2, 3]


def test_a_bag_whose_recording_was_killed_is_read_and_that_is_told(tmp_path):
    file = write_bag(tmp_path / 'bag', 9)
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    file.write_bytes(file.read_bytes()[:1_600_000])
    with BagReader(tmp_path / 'bag') as reader:
        assert numbers(m.data for m in reader.messages()) == [0, 1, 2, 3, 4]  # one of a chunk that is not whole
        assert any('cut off' in line for line in reader.left_out.lines()) and reader.count({'/a'}) == 5


def test_a_missing_and_a_broken_bag_are_named(tmp_path):
    with pytest.raises(BadRecording, match='no such file'):
        BagReader(tmp_path / 'none')
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'metadata.yaml').write_text('rosbag2_bagfile_information: 3')
    with pytest.raises(BadRecording, match='cannot be read'):
        with BagReader(tmp_path / 'bag'):
            pass

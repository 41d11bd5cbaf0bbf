# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The files of a recording are found with or without its metadata, unpacked, and read beyond what is damaged."""
import pytest
import yaml
from small_bags import FILE, MCAP, MESSAGE, NONE, SQLITE, first_chunk, numbers, write_bag
from tactile_driver.errors import BadRecording
from tactile_driver.recordings.left_out import LeftOut
from tactile_driver.recordings.storage import StorageFile, bag_files, unpacked


def test_files_are_those_of_the_metadata_or_all_that_there_are(tmp_path):
    bag = tmp_path / 'bag'
    write_bag(bag, 1)
    for name in ('bag_10.mcap', 'bag_9.mcap', 'notes.txt'):
        (bag / name).write_bytes(b'x')
    left_out = LeftOut()
    assert bag_files(bag, left_out) == ([bag / 'bag.mcap'], False) and left_out.total == 0
    (bag / 'metadata.yaml').unlink()
    files, _ = bag_files(bag, left_out)
    assert [file.name for file in files] == ['bag.mcap', 'bag_9.mcap', 'bag_10.mcap']
    assert left_out.lines() == ['1 of bag: there is no metadata.yaml: the recording was cut off']


def test_a_file_of_the_metadata_that_is_gone_is_told(tmp_path):
    write_bag(tmp_path / 'bag', 1)
    metadata = tmp_path / 'bag' / 'metadata.yaml'
    page = yaml.safe_load(metadata.read_text())
    page['rosbag2_bagfile_information']['relative_file_paths'].append('bag_1.mcap')
    metadata.write_text(yaml.safe_dump(page))
    left_out = LeftOut()
    assert len(bag_files(tmp_path / 'bag', left_out)[0]) == 1
    assert left_out.lines() == ['1 of bag: file bag_1.mcap is missing']
    (tmp_path / 'bag' / 'bag.mcap').unlink()
    with pytest.raises(BadRecording, match='no .mcap or .db3 file'):
        bag_files(tmp_path / 'bag', left_out)


@pytest.mark.parametrize('kept', [1.0, 0.6])
def test_a_compressed_file_is_unpacked_as_far_as_it_goes(tmp_path, kept):
    packed = write_bag(tmp_path / 'bag', 9, MCAP, FILE)
    data, left_out = packed.read_bytes(), LeftOut()
    packed.write_bytes(data[:int(kept * len(data))])
    plain = unpacked(packed, tmp_path, left_out)
    assert plain.name == 'bag.mcap'
    found = numbers(m[3] for m in StorageFile(plain, False, left_out).messages({'/a'}))
    assert found == list(range(len(found))) and (len(found) == 9) == (kept == 1) == (left_out.total == 0)
    assert unpacked(plain, tmp_path, left_out) == plain


def test_a_compressed_message_that_is_damaged_is_left_out_alone(tmp_path):
    file, left_out = write_bag(tmp_path / 'bag', 9, SQLITE, MESSAGE, size=1000), LeftOut()
    data = file.read_bytes()
    at = data.index(b'\x28\xb5\x2f\xfd', len(data) // 2)  # a message's beginning
    file.write_bytes(data[:at] + b'\0\0\0\0' + data[at + 4:])
    found = numbers(m[3] for m in StorageFile(file, True, left_out).messages({'/a'}))
    assert len(found) == 8 and left_out.total == 1 and 'a compressed message is damaged' in left_out.lines()[0]


def test_where_an_indexed_file_is_damaged_the_rest_is_read(tmp_path):
    file, left_out = write_bag(tmp_path / 'bag', 20), LeftOut()
    data = bytearray(file.read_bytes())
    second = data.index(b'\x06', first_chunk(data) + 1_200_000)  # of four messages, as each
    data[second + 33:second + 37] = b'\1\2\3\4'
    file.write_bytes(data)
    found = numbers(m[3] for m in StorageFile(file, False, left_out).messages({'/a'}))
    assert found == [0, 1, 2, 3, *range(8, 20)]
    assert sorted(left_out.lines())[-1] == '4 of bag.mcap: the checksum of their chunk is wrong'


def test_what_is_no_storage_is_refused(tmp_path):
    (tmp_path / 'x.txt').write_text('x')
    with pytest.raises(BadRecording, match='no .mcap or .db3 file'):
        StorageFile(tmp_path / 'x.txt', False, LeftOut())


def test_counts_and_definitions_are_known_before_reading(tmp_path):
    for storage in (MCAP, SQLITE):
        file = StorageFile(write_bag(tmp_path / storage.name, 3, storage, NONE), False, LeftOut())
        assert file.counts == {'/a': 3} and 'string data' in file.definitions['std_msgs/msg/String']
        file.close()

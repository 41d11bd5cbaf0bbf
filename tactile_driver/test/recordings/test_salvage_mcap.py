# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Of an MCAP file that is cut off or damaged all that is whole is read, and what is lost is told."""
import pytest
from small_bags import MCAP, NONE, STORAGE, TYPE, first_chunk, message, numbers, write_bag
from tactile_driver.recordings.left_out import LeftOut
from tactile_driver.recordings.salvage_mcap import SalvagedMcap


def read(file):
    left_out = LeftOut()
    bag = SalvagedMcap(file, left_out)
    found = list(bag.messages({'/a'}))
    assert sum(bag.counts.values()) == len(found)
    return bag, found, left_out


@pytest.mark.parametrize('compression', [NONE, STORAGE])
def test_a_whole_file_is_read_whole(tmp_path, compression):
    bag, found, left_out = read(write_bag(tmp_path / 'bag', 9, MCAP, compression))
    assert bag.topics == {'/a': TYPE} and 'string data' in bag.definitions[TYPE]
    assert found == [('/a', TYPE, 10 * (k + 1), message(k)) for k in range(9)]
    assert left_out.total == 0


@pytest.mark.parametrize('kept, count', [(0.5, 4), (0.95, 8), (0.001, 0)])
def test_a_file_that_is_cut_off_is_read_to_there(tmp_path, kept, count):
    file = write_bag(tmp_path / 'bag', 9)
    data = file.read_bytes()
    file.write_bytes(data[:int(kept * len(data))])
    _, found, left_out = read(file)
    assert numbers(m[3] for m in found) == list(range(count))
    assert f'the file is cut off at byte {int(kept * len(data))}' in left_out.lines()[0]


@pytest.mark.parametrize('number', [0, 1])
def test_only_the_chunk_that_is_damaged_is_lost(tmp_path, number):
    file = write_bag(tmp_path / 'bag', 9, MCAP, STORAGE)
    data = bytearray(file.read_bytes())
    at = -1
    for _ in range(number + 1):
        at = data.index(b'\x28\xb5\x2f\xfd', at + 1)  # where the compressed chunk begins
    data[at] ^= 0xff
    file.write_bytes(data)
    _, found, left_out = read(file)
    assert numbers(m[3] for m in found) == [k for k in range(9) if k // 4 != number]
    assert left_out.total == 1 and 'a chunk cannot be read' in left_out.lines()[0]


def test_a_chunk_whose_checksum_is_wrong_is_left_out(tmp_path):
    file = write_bag(tmp_path / 'bag', 9)
    data = bytearray(file.read_bytes())
    at = first_chunk(data) + 9 + 24  # kind and size, times, uncompressed size
    data[at:at + 4] = b'\1\2\3\4'
    file.write_bytes(data)
    _, found, left_out = read(file)
    assert numbers(m[3] for m in found) == list(range(4, 9))
    assert left_out.lines() == ['4 of bag.mcap: the checksum of their chunk is wrong']


def test_garbage_ends_it(tmp_path):
    file = tmp_path / 'x.mcap'
    file.write_bytes(b'no mcap')
    assert read(file)[2].lines() == ['1 of x.mcap: no MCAP file']
    whole = write_bag(tmp_path / 'bag', 9).read_bytes()
    file.write_bytes(whole[:len(whole) // 2] + bytes(1000))
    _, found, left_out = read(file)
    assert numbers(m[3] for m in found)[:4] == [0, 1, 2, 3] and left_out.total >= 1

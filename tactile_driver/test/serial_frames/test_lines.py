# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.serial.frames import LineReader, write_line


def test_lines_with_time_and_check_sum():
    reader = LineReader(4, 12)
    data = b'9,9\n' + b''.join(write_line([k, 2, 3, 4095], 1000 * k) for k in range(50))
    found = [f for k in range(0, len(data), 5) for f in reader.feed(data[k:k + 5])]
    assert [f.time_us for f in found] == [1000 * k for k in range(50)]
    assert found[7].values.tolist() == [[7, 2, 3, 4095]] and found[7].sequence is None
    assert reader.counts.frames == 50 and reader.counts.garbage == 0


@pytest.mark.parametrize('line', [b'1,2,3,4', b'1; 2; 3; 4\r', b'1\t2\t3\t4', b'  1 2 3 4 '])
def test_what_hobby_boards_print(line):
    found, = LineReader(4, 12).feed(b'cut off\n# a comment\n\n' + line + b'\n')
    assert found.values.tolist() == [[1, 2, 3, 4]] and found.time_us is None


@pytest.mark.parametrize('line', [b'1,2,3', b'1,2,3,4,5,6', b'1,2,3,4096', b'1,2,x,4', b'1,,3,4', b'1,2,-3,4', b'1.5,2,3,4',
                                  b'\xff\xfe1,2,3,4', b'4294967296,1,2,3,4', b'1,2,3,4*0000', b'1,2,3,99999999999'])
def test_what_is_no_sample_is_counted(line):
    reader = LineReader(4, 12)
    assert reader.feed(b'\n' + line + b'\n') == []
    assert reader.counts.garbage + reader.counts.refused + reader.counts.bad_crc > 0


def test_once_checked_always_checked():
    reader = LineReader(4, 12)
    assert len(reader.feed(b'\n' + write_line([1, 2, 3, 4]) + b'1,2,3,4\n')) == 1
    assert reader.counts.bad_crc == 1


def test_mutated_lines_with_check_sums_give_no_false_sample():
    rng = np.random.default_rng(2)
    sent = {k: rng.integers(0, 4096, 4).tolist() for k in range(5000)}
    parts = []
    for k, values in sent.items():
        line = bytearray(write_line(values, k))
        spot = int(rng.integers(0, len(line)))
        kind = k % 7
        if kind == 0:
            del line[spot]
        elif kind == 1:
            line[spot] = int(rng.integers(0, 256))
        elif kind == 2:
            line[spot:spot] = rng.bytes(3)
        parts.append(bytes(line))
    reader = LineReader(4, 12)
    found = reader.feed(b''.join(parts) + rng.bytes(100_000))
    assert len(found) > 2500
    assert all(f.values[0].tolist() == sent[f.time_us] for f in found)


@pytest.mark.parametrize(('channels', 'bits'), [(0, 12), (4, 17), (4, 7), (65, 12)])
def test_bad_arguments(channels, bits):
    with pytest.raises(BadArgument):
        LineReader(channels, bits)

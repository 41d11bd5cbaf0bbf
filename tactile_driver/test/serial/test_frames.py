# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The serial protocols: binary frames and lines, whole and damaged; any bytes at all: test/stability/test_serial_bytes.py."""

import numpy as np
import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.serial.frames import (
    END, MATRIX, SAMPLES, BinaryReader, CountFrame, Expected, LineReader, frame_size, write_frame, write_line)

RNG = np.random.default_rng(5)


def frame(k, rows=5, columns=4, bits=12, rng=RNG):
    return CountFrame(rng.integers(0, 2**bits, (rows, columns)).astype(np.uint16), 1000 * k, 200_000, k, bits)


def reader(columns=4):
    return BinaryReader(Expected(SAMPLES, columns=columns))


def feed(target, data, step):
    return [found for k in range(0, len(data), step) for found in target.feed(data[k:k + step])]


def same(found, sent):
    return (found.sequence, found.time_us, found.interval_ns, found.bits) == (sent.sequence, sent.time_us, sent.interval_ns, sent.bits) \
        and np.array_equal(found.values, sent.values)


@pytest.mark.parametrize('step', [1, 7, 63, 10_000])
def test_what_is_written_is_read_however_it_is_cut(step):
    sent = [frame(k, rows=1 + k % 9, bits=12 + k % 5) for k in range(60)]
    target = reader()
    found = feed(target, b''.join(write_frame(f, SAMPLES) for f in sent), step)
    assert len(found) == 60 and all(map(same, found, sent))
    assert (target.counts.frames, target.counts.bad_crc, target.counts.garbage, target.counts.missing) == (60, 0, 0, 0)


@pytest.mark.parametrize(('rows', 'columns', 'bits'), [(44, 44, 8), (256, 256, 16), (1, 1, 9), (256, 1, 12)])
def test_a_matrix_of_any_shape_is_carried(rows, columns, bits):
    sent = frame(3, rows, columns, bits)
    data = write_frame(sent, MATRIX)
    assert len(data) == frame_size(rows, columns, bits) == 23 + rows * columns * (1 if bits == 8 else 2)
    found, = BinaryReader(Expected(MATRIX, rows, columns)).feed(data)
    assert same(found, sent)
    refusing = BinaryReader(Expected(MATRIX, rows + 1, columns))  # of 257 rows there can be none
    assert refusing.feed(data) == [] and refusing.counts.refused == 1
    assert refusing.counts.stranger == f'a matrix of {rows} x {columns} values of {bits} bits'
    assert len(refusing.feed(write_frame(frame(4, rows % 256 + 1, columns, bits), MATRIX))) == (rows < 256)
    assert refusing.counts.stranger == ('' if rows < 256 else f'a matrix of 1 x {columns} values of {bits} bits')


def test_the_bytes_are_those_of_the_page():
    data = write_frame(CountFrame(np.array([[1, 2, 3, 0xABC]]), 0x01020304, 200_000, 7, 12), SAMPLES)
    assert data[:20].hex() == 'a55a010c0700000004030201400d03000003' + data[18:20].hex()
    assert data[20:28].hex() == '010002000300bc0a' and data[-1] == END == 0x7E
    from binascii import crc_hqx
    assert crc_hqx(b'123456789', 0xFFFF) == 0x29B1
    assert data[18:20] == crc_hqx(data[:18], 0xFFFF).to_bytes(2, 'little')
    assert data[28:30] == crc_hqx(data[:18] + data[20:28], 0xFFFF).to_bytes(2, 'little')


@pytest.mark.parametrize(('values', 'bits'), [(np.zeros((0, 4)), 12), (np.zeros((257, 4)), 12), (np.zeros(4), 12),
                                              (np.full((1, 4), 4096), 12),
                                              (np.full((1, 4), -1), 12), (np.zeros((1, 4)), 17), (np.zeros((1, 4)), 7)])
def test_what_no_frame_can_carry_is_refused(values, bits):
    with pytest.raises(BadArgument, match='frame: '):
        write_frame(CountFrame(values.astype(int), 0, 0, 0, bits), SAMPLES)


@pytest.mark.parametrize('place', range(68))
def test_any_changed_byte_breaks_one_frame_and_no_more(place):
    frames = [frame(k) for k in range(3)]
    data = bytearray(b''.join(write_frame(f, SAMPLES) for f in frames))
    size = len(data) // 3
    if place >= size:
        return
    data[size + place] ^= 0x41
    target = reader()
    assert [f.sequence for f in target.feed(bytes(data))] == [0, 2]
    assert target.counts.missing == 1


def test_gaps_and_resets_are_counted():
    target = reader()
    for k in (2**32 - 2, 2**32 - 1, 0, 1, 5, 6, 3):
        target.feed(write_frame(frame(k), SAMPLES))
    assert (target.counts.frames, target.counts.missing, target.counts.resets) == (7, 3, 1)


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

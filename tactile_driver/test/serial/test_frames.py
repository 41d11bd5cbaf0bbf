# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The serial protocols: binary frames and lines, whole and damaged; any bytes at all: test/stability/test_serial_bytes.py."""
import numpy as np
import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.serial.clock import DeviceClock, SampleAssembler
from tactile_driver.serial.frames import (
    END, MATRIX, SAMPLES, BinaryReader, CountFrame, LineReader, frame_size, write_frame, write_line)

RNG = np.random.default_rng(5)


def frame(k, rows=5, columns=4, bits=12, rng=RNG):
    return CountFrame(rng.integers(0, 2**bits, (rows, columns)).astype(np.uint16), 1000 * k, 200_000, k, bits)


def reader(columns=4):
    return BinaryReader(SAMPLES, columns=columns)


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
    found, = BinaryReader(MATRIX, rows, columns).feed(data)
    assert same(found, sent)
    refusing = BinaryReader(MATRIX, rows + 1, columns)  # of 257 rows there can be none
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


def played(skew, delays, start_us=0, step_us=5000, host_ns=7_000_000_000):
    """(true host times, mapped host times), ns, of frames every step_us of a device's clock that runs fast by skew."""
    clock = DeviceClock()
    true, mapped = [], []
    for k, delay in enumerate(delays):
        true.append(host_ns + k * step_us * 1000 / (1 + skew))
        mapped.append(clock.to_host([(start_us + k * step_us) % 2**32], round(true[-1] + delay))[0])
    return np.array(true), np.array(mapped), clock


@pytest.mark.parametrize('skew', [0.0, 80e-6, -80e-6])
def test_jitter_is_taken_off_and_drift_is_followed(skew):
    rng = np.random.default_rng(1)
    true, mapped, clock = played(skew, 3e5 + rng.exponential(2e6, 12000))
    late = mapped - true
    assert np.abs(late[6000:] - 3e5).max() < 1e5 + 5e9 * abs(skew)  # ns; it looks back 5 s
    assert np.abs(np.diff(mapped) - 5e6).max() < 0.06 * 5e6
    assert clock.resets == 0


def test_the_counter_may_wrap():
    true, mapped, clock = played(0.0, np.full(3000, 1e5), start_us=2**32 - 2_000_000)
    assert np.abs(mapped - true - 1e5).max() < 1e3 and clock.resets == 0


def test_a_reset_and_a_pause_begin_anew_or_go_on():
    clock = DeviceClock()
    for k in range(100):
        clock.to_host([10_000_000 + 5000 * k], 10**10 + 5_000_000 * k)
    assert clock.to_host([0], 10**10 + 2 * 10**9) == [10**10 + 2 * 10**9] and clock.resets == 1
    assert clock.to_host([60_000_000], 10**10 + 62 * 10**9) == [10**10 + 62 * 10**9] and clock.resets == 1


def test_time_never_goes_back():
    _, mapped, _ = played(0.0, np.r_[np.full(200, 2e7), np.full(2000, 1e5)])
    assert np.diff(mapped).min() > 0


def test_frames_that_come_in_one_go_keep_their_distances():
    clock = DeviceClock()
    assert np.diff(clock.to_host([0, 1000, 2000, 3000], 5_000_000, 800_000)).tolist() == [1_000_000] * 3
    assert clock.to_host([4000], 9_000_000)[0] == 5_200_000  # the earlier arrival tells


def test_a_reset_amid_the_frames_of_one_go():
    clock = DeviceClock()
    clock.to_host([50_000_000], 10**9)
    before, after = clock.to_host([50_001_000, 0], 10**9 + 1_000_000)
    assert (before, after, clock.resets) == (10**9 + 1_000_000, 10**9 + 1_000_000, 1)


def counted(k, rows=5, period_us=200, interval=True, timed=True):
    values = np.tile(np.arange(k * rows, (k + 1) * rows, dtype=np.uint16)[:, None], (1, 4))
    return CountFrame(values, (k * rows * period_us) % 2**32 if timed else None, period_us * 1000 if interval else None, k, 12)


def test_frames_without_a_gap_are_one_block():
    blocks = SampleAssembler(5.0).assemble([counted(k) for k in range(10)], 10**9)
    assert len(blocks) == 1
    assert blocks[0].volts.shape == (50, 4) and blocks[0].volts.dtype == np.float32
    assert blocks[0].volts[:, 2] == pytest.approx(np.arange(50) * 5 / 4096)
    assert blocks[0].period_s == pytest.approx(200e-6)


def test_a_missing_frame_parts_two_blocks():
    assembler = SampleAssembler(5.0)
    first = assembler.assemble([counted(0), counted(1)], 2_000_000)
    blocks = assembler.assemble([counted(2), counted(4), counted(5)], 6_000_000)
    assert [len(b.volts) for b in first + blocks] == [10, 5, 10]
    assert blocks[1].stamp_ns - blocks[0].stamp_ns == pytest.approx(2_000_000, abs=1e5)
    assert assembler.missing == 5


def test_lines_with_time_but_without_an_interval():
    assembler = SampleAssembler(5.0)
    assembler.assemble([counted(0, 1, 1000, interval=False)], 0)
    block, = assembler.assemble([counted(k, 1, 1000, interval=False) for k in range(1, 6)], 5_000_000)
    assert len(block.volts) == 5 and block.period_s == pytest.approx(1e-3, rel=0.06)
    blocks = assembler.assemble([counted(k, 1, 1000, interval=False) for k in (6, 7, 10, 11)], 11_000_000)
    assert [len(b.volts) for b in blocks] == [2, 2] and assembler.missing == 2


def test_lines_without_time_lie_between_arrivals():
    assembler = SampleAssembler(5.0)
    first, = assembler.assemble([counted(0, 1, timed=False, interval=False)], 1_000_000)
    assert np.isnan(first.period_s) and first.stamp_ns == 1_000_000
    block, = assembler.assemble([counted(k, 1, timed=False, interval=False) for k in range(4)], 5_000_000)
    assert block.period_s == pytest.approx(1e-3) and block.stamp_ns == 2_000_000

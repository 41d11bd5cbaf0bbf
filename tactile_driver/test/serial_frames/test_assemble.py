# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.serial.clock import SampleAssembler
from tactile_driver.serial.frames import CountFrame


def frame(k, rows=5, period_us=200, interval=True, timed=True):
    values = np.tile(np.arange(k * rows, (k + 1) * rows, dtype=np.uint16)[:, None], (1, 4))
    return CountFrame(values, (k * rows * period_us) % 2**32 if timed else None, period_us * 1000 if interval else None, k, 12)


def test_frames_without_a_gap_are_one_block():
    blocks = SampleAssembler(5.0).assemble([frame(k) for k in range(10)], 10**9)
    assert len(blocks) == 1
    assert blocks[0].volts.shape == (50, 4) and blocks[0].volts.dtype == np.float32
    assert blocks[0].volts[:, 2] == pytest.approx(np.arange(50) * 5 / 4096)
    assert blocks[0].period_s == pytest.approx(200e-6)


def test_a_missing_frame_parts_two_blocks():
    assembler = SampleAssembler(5.0)
    first = assembler.assemble([frame(0), frame(1)], 2_000_000)
    blocks = assembler.assemble([frame(2), frame(4), frame(5)], 6_000_000)
    assert [len(b.volts) for b in first + blocks] == [10, 5, 10]
    assert blocks[1].stamp_ns - blocks[0].stamp_ns == pytest.approx(2_000_000, abs=1e5)
    assert assembler.missing == 5


def test_lines_with_time_but_without_an_interval():
    assembler = SampleAssembler(5.0)
    assembler.assemble([frame(0, 1, 1000, interval=False)], 0)
    block, = assembler.assemble([frame(k, 1, 1000, interval=False) for k in range(1, 6)], 5_000_000)
    assert len(block.volts) == 5 and block.period_s == pytest.approx(1e-3, rel=0.06)
    blocks = assembler.assemble([frame(k, 1, 1000, interval=False) for k in (6, 7, 10, 11)], 11_000_000)
    assert [len(b.volts) for b in blocks] == [2, 2] and assembler.missing == 2


def test_lines_without_time_lie_between_arrivals():
    assembler = SampleAssembler(5.0)
    first, = assembler.assemble([frame(0, 1, timed=False, interval=False)], 1_000_000)
    assert np.isnan(first.period_s) and first.stamp_ns == 1_000_000
    block, = assembler.assemble([frame(k, 1, timed=False, interval=False) for k in range(4)], 5_000_000)
    assert block.period_s == pytest.approx(1e-3) and block.stamp_ns == 2_000_000


def test_nothing_gives_nothing():
    assert SampleAssembler(5.0).assemble([], 0) == []

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Dark samples are subtracted, whatever the blocks."""
import numpy as np
import pytest

from tactile_driver.samples import SampleBlock
from tactile_driver.serial.psd import Demodulator

RATE = 10_000.0
PERIOD_NS = round(1e9 / RATE)
LIGHT = np.array([0.5, 0.8, 1.1, 0.4], np.float32)


def samples(count, ambient, lit=None):
    """(count, 5) V: the light of a contact on every second sample, over ambient light (count,)."""
    lit = np.arange(count) % 2 == 0 if lit is None else lit
    return np.column_stack([lit[:, None] * LIGHT + np.asarray(ambient)[:, None] / 4, lit]).astype(np.float32)


def net(rows, size, begin_ns=10**9):
    """All net blocks of rows in blocks of that size."""
    made = Demodulator(4.9)
    return made, [part for k in range(0, len(rows), size)
                  for part in made.net(SampleBlock(rows[k:k + size], begin_ns + k * PERIOD_NS, 1 / RATE))]


@pytest.mark.parametrize('size', [1, 2, 7, 50, 1000])
def test_ambient_light_flicker_and_steps_are_gone_and_stamps_are_those_of_the_lit_samples(size):
    t = np.arange(1000) / RATE
    ambient = 1.2 + 0.3 * np.sin(200 * np.pi * t) + 2 * np.clip((t - 0.05) / 0.02, 0, 1)
    made, blocks = net(samples(1000, ambient), size)
    volts = np.concatenate([block.volts for block in blocks])
    assert volts == pytest.approx(np.tile(LIGHT, (499, 1)), abs=2e-3)
    stamps = np.concatenate([block.stamp_ns + 2 * PERIOD_NS * np.arange(len(block.volts)) for block in blocks])
    assert stamps.tolist() == [10**9 + k * PERIOD_NS for k in range(2, 1000, 2)]
    assert {block.period_s for block in blocks} == {2 / RATE} and made.missing <= 1


def test_what_lacks_a_dark_neighbour_is_left_out_and_counted():
    lit = np.arange(40) % 2 == 0
    lit[21] = True  # three lit samples in a row
    made, blocks = net(samples(40, np.zeros(40), lit), 40)
    assert [len(block.volts) for block in blocks] == [9, 8] and made.missing >= 3
    assert blocks[1].stamp_ns == 10**9 + 24 * PERIOD_NS


def test_samples_around_a_gap_are_not_joined():
    rows, made = samples(40, np.zeros(40)), Demodulator(4.9)
    first = made.net(SampleBlock(rows[:20], 10**9, 1 / RATE))
    second = made.net(SampleBlock(rows[21:], 10**9 + 35 * PERIOD_NS, 1 / RATE))
    assert [b.stamp_ns for b in first + second] == [10**9 + 2 * PERIOD_NS, 10**9 + 36 * PERIOD_NS]


def test_a_saturated_output_stays_saturated():
    rows = samples(20, np.full(20, 16.0))
    rows[::2, 2] = 4.95
    _, blocks = net(rows, 20)
    assert (blocks[0].volts[:, 2] >= 4.9).all() and blocks[0].volts[:, 0] == pytest.approx(LIGHT[0], abs=1e-5)


def test_without_a_known_period_or_light_there_is_nothing():
    made = Demodulator(4.9)
    assert made.net(SampleBlock(samples(5, np.zeros(5)), 10**9, float('nan'))) == []
    assert made.net(SampleBlock(samples(8, np.zeros(8), np.zeros(8, bool)), 2 * 10**9, 1 / RATE)) == []

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.sources.source import SceneSource


class Counting(SceneSource):
    """Hands over the number of the first step and when that was due; slow: s that making it takes."""

    usual_rate = 200.0
    slow = 0.0

    def _open_scene(self):
        return 'scene'

    def _make(self, number):
        time.sleep(self.slow)
        return number

    def _handed_over(self, made, due_ns):
        return made, due_ns


def opened(rate=-1.0, count=1):
    source = Counting('any', rate, 0, time.time_ns, count)
    source.open()
    return source


def test_steps_come_in_order_at_their_pace():
    source = opened(count=4)
    numbers, due = zip(*(source.read() for _ in range(5)))
    assert numbers == (0, 4, 8, 12, 16)
    assert np.diff(due) == pytest.approx([20e6] * 4, abs=1e3)
    assert source.rate == 200.0 and source.describe()['scene'] == 'any' and source.calibration() is None


def test_a_scene_stands_still_while_nobody_wants_it_and_begins_anew_when_opened_again():
    source = opened()
    assert source.read()[0] == 0
    assert [source.read(wanted=False) for _ in range(5)] == [None] * 5
    assert source.read()[0] == 1
    source.close()
    source.open()
    assert source.read()[0] == 0


def test_after_a_stall_only_a_few_steps_are_leapt_over_and_all_are_counted():
    source = opened()
    source.read()
    time.sleep(0.1)
    assert source.read()[0] == 1 + source.longest_leap
    assert source.skipped >= 15


def test_no_rate_is_refused():
    with pytest.raises(BadArgument, match='real time.*200 Hz'):
        Counting('any', 0.0, 0, time.time_ns)

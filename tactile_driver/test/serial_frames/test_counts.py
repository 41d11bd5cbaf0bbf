# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from tactile_driver.serial.frames import FrameCounts, SequenceCheck


def test_a_step_beyond_the_longest_gap_is_a_reset():
    counts = FrameCounts()
    check = SequenceCheck(counts, longest_gap=10)
    for number in (5, 6, 16, 27, 27):
        check.take(number)
    assert (counts.missing, counts.resets) == (9, 2)

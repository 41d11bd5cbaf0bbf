# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from lucas_kanade import LucasKanade  # noqa: E402

PITCH, RATE = 1e-3, 50.0


def image(place):
    """Four rough spots about a place (x), taxels."""
    row, column = np.mgrid[0:30, 0:30]
    spots = [(10, 10, 90), (18, 9, 120), (11, 19, 150), (19, 18, 70)]
    return sum(height * np.exp(-((row - y)**2 + (column - x - place)**2) / 6) for y, x, height in spots).astype(np.uint8)


def last(places):
    flow = LucasKanade(PITCH)
    flow.process(np.zeros((30, 30), np.uint8), 1.0)
    return [flow.process(image(place), 1.02 + k / RATE) for k, place in enumerate(places)][-1]


@pytest.mark.parametrize('speed', [0.1, -0.2])
def test_what_moves_as_a_whole_slips_as_a_whole(speed):
    found = last(speed * np.arange(10))
    assert found.state == 2 and found.slipping_fraction > 0.9
    assert found.linear[:2] == pytest.approx([speed * PITCH * RATE, 0], abs=4e-4)


def test_what_stands_still_sticks():
    found = last(np.zeros(10))
    assert (found.state, found.slipping_fraction) == (0, 0.0) and not found.linear.any()


def test_untouched_nothing_is_told():
    flow = LucasKanade(PITCH)
    found = [flow.process(np.full((20, 20), 3, np.uint8), 1 + k / RATE) for k in range(3)][-1]
    assert found.state == 0 and np.isnan(found.slipping_fraction)

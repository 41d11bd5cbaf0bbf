# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which presses of a guided calibration count."""
import numpy as np
import pytest
from tactile_bringup.guide.session import Sample, Session

SIZE, RATE, ABOVE = (0.060, 0.045), 20.0, 0.005


class Hand:
    """Moves a tip over a session; holds the wrench's last value where stuck is set."""

    def __init__(self):
        self.session, self.now, self.tip, self.stuck, self.changed = Session(SIZE), 0.0, np.array([0.0, 0.0, ABOVE]), False, 0.0
        self.taken, self.told = [], []

    def go(self, tip, seconds):
        """To a tip (3,) m, evenly, within so many s."""
        begin, count = self.tip, round(seconds * RATE)
        for k in range(1, count + 1):
            self.tip, self.now = begin + (np.asarray(tip, float) - begin) * k / count, self.now + 1 / RATE
            self.changed = self.changed if self.stuck else self.now
            press, told = self.session.add(Sample(self.now, self.tip, np.zeros(6), self.changed, k))
            if press is not None:
                self.session.done.append((press.place, press.depths))
                self.taken.append(press)
            self.told += [told] if told else []

    def press(self, x=0.0, y=0.0, depths=(0.002, 0.004), pause=1.5, hold=0.8, slide=0.0):
        self.go((x, y, ABOVE), 0.2)
        self.go((x, y, ABOVE), pause)
        for depth in depths:
            self.go((x, y, -depth), 0.5)
            self.go((x, y, -depth), hold)
        if slide:
            self.go((x + slide, y, -depths[-1]), 0.5)
        self.go((x + slide, y, ABOVE), 0.5)


def test_a_press_that_counts_has_its_place_its_depths_and_untouched_images_before():
    hand = Hand()
    hand.press(0.01, -0.005)
    press, = hand.taken
    assert press.place == pytest.approx([0.01, -0.005]) and press.depths == pytest.approx([0.002, 0.004])
    assert len(press.rest) >= 5 and all(sample.tip[2] > 0 for sample in press.rest)
    assert all(sample.tip[2] == pytest.approx(hold[0].tip[2], abs=5e-5) for hold in press.holds for sample in hold)
    assert len(hand.session.open_places) == 11


@pytest.mark.parametrize(('how', 'why'), [
    ({'pause': 0.0}, 'without 1 s untouched'), ({'hold': 0.2}, 'never stood still'), ({'slide': 0.003}, 'slid'),
    ({'x': 0.031}, 'outside the sheet')])
def test_a_press_that_does_not_count_is_dropped_and_told(how, why):
    hand = Hand()
    hand.press(**how)
    assert hand.taken == [] and any(why in told for told in hand.told) and hand.told[-1].startswith('dropped')
    hand.press()
    assert len(hand.taken) == 1, 'the next one counts'


def test_a_wrench_that_stands_still_spoils_the_press():
    hand = Hand()
    hand.stuck = True
    hand.press()
    assert hand.taken == [] and any('saturated or has stopped' in told for told in hand.told)


def test_a_probe_that_jumps_or_whose_place_is_lost_spoils_the_press():
    hand = Hand()
    hand.go((0, 0, ABOVE), 1.5)
    hand.go((0, 0, -0.003), 0.5)
    hand.tip = np.array([0.025, 0.02, -0.003])
    hand.go((0.025, 0.02, -0.003), 1.0)
    hand.go((0.025, 0.02, ABOVE), 0.5)
    assert hand.taken == [] and any('jumped by 32.0 mm' in told for told in hand.told)
    hand.go((0, 0, ABOVE), 1.5)
    hand.go((0, 0, -0.003), 0.5)
    hand.session.drop('/tf has stopped')
    hand.go((0, 0, -0.003), 1.0)
    hand.go((0, 0, ABOVE), 0.5)
    assert hand.taken == [] and hand.told[-1] == 'dropped: /tf has stopped'


def test_the_twelve_places_are_led_through():
    hand = Hand()
    while hand.session.open_places:
        hand.press(*hand.session.places[hand.session.open_places[0]])
    assert len(hand.taken) == 12 and hand.session.advice == 'all places are pressed'
    green = hand.session.picture()
    assert ((green[..., 1] > 150) & (green[..., 0] < 100)).sum() > 12 * 150

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which presses of a guided calibration count; what else spoils one: test_session_faults.py."""
import numpy as np
import pytest
from tactile_bringup.guide.loads import Loads
from tactile_bringup.guide.session import Sample, Session
from tactile_bringup.guide.surfaces import Fingertip, MarkedSurface
from tactile_perception.press.sensor import MARKER_SENSORS

RATE, ABOVE = 20.0, 0.005


class Hand:
    """Moves a tip over a session."""

    def __init__(self):
        self.session, self.now = Session(MarkedSurface(MARKER_SENSORS['areal_single'], 0.0)), 0.0
        self.tip = np.array([0.0, 0.0, ABOVE])
        self.taken, self.reported = [], []

    def go(self, tip, seconds):
        """To a tip (3,) m, evenly, within so many s."""
        begin, count = self.tip, round(seconds * RATE)
        for k in range(1, count + 1):
            self.tip, self.now = begin + (np.asarray(tip, float) - begin) * k / count, self.now + 1 / RATE
            press, reported = self.session.add(Sample(self.now, self.tip, np.zeros(6), self.now, k))
            if press is not None:
                self.session.keep(press)
                self.taken.append(press)
            self.reported += [reported] if reported else []

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
    (place, depths), = hand.session.done
    assert place == pytest.approx([0.01, -0.005]) and depths == pytest.approx([0.002, 0.004])
    assert len(press.rest) >= 5 and all(sample.tip[2] > 0 for sample in press.rest)
    assert len(press.touched) == 6 and all(min(abs(sample.tip[2] + depth) for depth in depths) < 5e-5 for sample in press.touched)
    assert len(hand.session.open_places) == 11


@pytest.mark.parametrize(('how', 'why'), [
    ({'pause': 0.0}, 'without 1 s untouched'), ({'hold': 0.2}, 'never stood still'), ({'slide': 0.003}, 'slid')])
def test_a_press_that_does_not_count_is_dropped_and_reported(how, why):
    hand = Hand()
    hand.press(**how)
    assert hand.taken == [] and any(why in reported for reported in hand.reported) and hand.reported[-1].startswith('dropped')
    hand.press()
    assert len(hand.taken) == 1, 'the next one counts'


def test_the_twelve_places_are_led_through():
    hand = Hand()
    while hand.session.open_places:
        hand.press(*hand.session.places[hand.session.open_places[0]])
    assert len(hand.taken) == 12 and hand.session.advice == 'all places are pressed'
    green = hand.session.picture()
    assert ((green[..., 1] > 150) & (green[..., 0] < 100)).sum() > 12 * 150


def test_a_dome_is_pressed_along_z_and_a_finger_along_its_normal():
    dome, finger = MarkedSurface(MARKER_SENSORS['air_cushion'], 0.03), Fingertip(0.016)
    top, aside = np.array([0.0, 0.0, 0.10]), np.array([0.08, 0.0, 0.08])
    assert dome.depth(top) == pytest.approx(0.02) and np.isnan(dome.depth(np.array([0.3, 0.0, 0.0])))
    curved, tip = 0.15375, 0.03  # m: radius of the sphere over a rim of 150 and a height of 120 mm, and of the tip
    touching = aside + [0, 0, dome.depth(aside) + tip]  # the tip's centre as it just touches
    assert np.linalg.norm(touching - [0, 0, 0.12 - curved]) == pytest.approx(curved + tip)
    pressed = 0.0157 * np.array([0.6, 0.0, 0.8])
    position, normal = finger.contact(pressed)
    assert finger.depth(pressed) == pytest.approx(3e-4) and position == pytest.approx([0.0096, 0, 0.0128])
    assert normal == pytest.approx([0.6, 0.0, 0.8])


@pytest.mark.parametrize('weights', [(), (10.0, 20.0, 10.0, 0.0)])
def test_loads_are_reported_by_a_force_sensor_or_are_known_weights(weights):
    loads, rng, found, forces = Loads(weights), np.random.default_rng(0), [], [0.0, 10.0, 20.0, 10.0, 0.0]
    for number, force in enumerate(forces):
        if weights and number:
            loads.next_weight()
        for k in range(140 if number == 4 else 30):
            now = 1.5 * number + k / RATE
            wrench = np.zeros(6) if weights else np.array([0.3, 0, -2.0 - force, 0, 0, 0]) + rng.normal(0, 0.01, 6)
            press, _ = loads.add(Sample(now, np.full(3, np.nan), wrench, now, k))
            if press:
                loads.keep(press)
                found.append(press)
    press, = found
    tare = np.mean([sample.wrench for sample in press.rest], axis=0)
    reported = np.array([(sample.wrench - tare)[2] for sample in press.touched])
    assert {0, -10, -20} == set(np.round(reported)) and (reported[-40:] == 0).all(), 'the noise of nothing is no load'

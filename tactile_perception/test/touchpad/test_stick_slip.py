# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip: of dots, and of the object."""
import numpy as np
import pytest

from tactile_perception._core import DotLoads, StickSlip
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.touchpad.region import ContactDots, ContactFinder, describe, find_regions
from tactile_perception.touchpad.slip import SlipEstimator, slip_confidence

ORIGIN = np.array([0.0, 0.0, -0.04])
SIDE = 13
STICKING, SLIPPING = 1, 2


class Tracker(StickSlip):
    """StickSlip of dots at 30 frames a second."""

    def __init__(self, side=SIDE):
        super().__init__(side, side, ORIGIN)

    def update(self, loads, score):
        return super().update(loads, np.asarray(score, float), 1 / 30)


class Face:
    """A flat face on a square patch of dots, with given motion and friction ratio frame by frame."""

    def __init__(self, seed=0):
        self.rng = np.random.default_rng(seed)
        row, column = np.divmod(np.arange(SIDE**2), SIDE)
        self.xyz = np.column_stack([(column - 6) * 1.4e-3, (row - 6) * 1.4e-3, np.full(SIDE**2, 0.0105)])
        self.inside = (np.abs(row - 6) <= 3) & (np.abs(column - 6) <= 3)
        self.score = self.inside.astype(float)

    def state(self, step, ratio):
        """The next frame: the dots move by step (3,) or (K, 3), m, and carry ratio times the normal load along x."""
        self.xyz = self.xyz + np.where(self.inside[:, None], step, 0)
        rays = self.xyz - ORIGIN
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        seen = self.xyz + self.rng.normal(size=self.xyz.shape) * 1e-6 + rays * self.rng.normal(size=(SIDE**2, 1)) * 10e-6
        force = np.outer(self.inside, [0, 0, -6e-3]) + np.outer(self.inside * 6e-3 * ratio, [1, 0, 0])
        force = force + self.rng.normal(size=force.shape) * [1e-3, 1e-3, 0]
        count = SIDE**2
        return DotLoads(seen, np.ones(count, bool), np.tile([0, 0, 1.0], (count, 1)), force, self.score)


def test_the_noise_is_learnt_while_nothing_touches():
    face, states = Face(), Tracker()
    for _ in range(40):
        states.update(face.state([0, 0, 0], 0.0), np.zeros(SIDE**2))
    assert states.noise == pytest.approx(np.sqrt(2) * 1e-6, rel=0.3)


def test_a_face_that_carries_all_dots_along_sticks_whatever_its_friction():
    face, states = Face(), Tracker()
    for frame in range(8):
        found = states.update(face.state([120e-6, 0, -200e-6], 0.1 * frame), face.score)
        np.testing.assert_array_equal(found[face.inside], STICKING)


def _drag_until_it_slips(face, states, friction, speed=150e-6):
    """Stick, carried along by speed, m a frame, then slip from one side inwards, dragged along unevenly, then all together; returns the
    fraction found slipping in each frame."""
    fractions, column, uneven = [], np.arange(SIDE**2) % SIDE, np.random.default_rng(0).uniform(0.2, 1.8, SIDE**2)
    for frame in range(14):
        slipping = np.clip((frame - 5) / 4, 0, 1) * 7 > column - 3
        ratio = np.where(slipping, friction, min(0.08 * frame, friction))
        step = np.outer(np.where(slipping, 20e-6 * uneven if frame < 10 else max(6e-6, speed / 50), speed), [1, 0, 0])
        found = states.update(face.state(step, ratio), face.score)
        fractions.append(((found == SLIPPING) & face.inside).sum() / face.inside.sum())
    return fractions


def test_gross_slip_is_reported_though_the_dots_hardly_move_any_more():
    face, states = Face(), Tracker()
    fractions = _drag_until_it_slips(face, states, 0.6)
    assert max(fractions[:5]) < 0.05
    assert 0.3 < fractions[7] < 0.8
    assert min(fractions[10:]) > 0.95
    assert states.friction == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize('speed', [100e-6, 150e-6])
def test_an_object_that_stops_after_gross_slip_over_dots_that_hardly_moved_rests_within_a_tenth_of_a_second(speed):
    face, states = Face(), Tracker()
    assert _drag_until_it_slips(face, states, 0.6, speed)[-1] == 1
    for frame in range(1, 6):
        found = states.update(face.state([0, 0, 0], 0.6), face.score)
        assert frame < 3 or (found[face.inside] == STICKING).all()


def test_whether_an_object_slides_on_over_dots_that_came_to_rest_by_themselves_is_not_known():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    for frame in range(60):
        states.update(face.state([6e-6 * 0.7**frame, 0, 0], 0.6), face.score)
        slides, rests = states.objects[0].odds[2:]
        assert slides + rests > 0.99 and (frame < 25 or 0.2 < rests < 0.8)
    assert 0.2 < slip_confidence(2, states.objects) < 0.7 and 0.2 < slip_confidence(0, states.objects) < 0.7


def test_an_object_that_rested_after_gross_slip_and_gets_under_way_backwards_sticks():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    for step, ratio in ((0, 0.6), (0, 0.6), (0, 0.6), (-5e-6, 0.57), (-15e-6, 0.5), (-40e-6, 0.35), (-80e-6, 0.1)):
        found = states.update(face.state([step, 0, 0], ratio), face.score)
    assert np.mean(found[face.inside] == STICKING) > 0.95


def test_way_in_gross_slip_is_that_of_the_last_motion_that_held_dots_for_a_second():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    for frame in range(34):
        found = states.update(face.state([4e-6, 0, 0], 0.6), face.score)
        ways = states.ways()
        assert np.mean(found[face.inside] == SLIPPING) == 1 and np.isnan(ways[~face.inside]).all()
        if 4 < frame < 24:
            np.testing.assert_allclose(ways[face.inside], np.tile([146e-6, 0], (49, 1)), atol=8e-6)
    assert np.isnan(ways).all()


@pytest.mark.parametrize('step, known', [([150e-6, 0, 0], True), ([0, 0, -200e-6], True), ([0, 0, 200e-6], False)])
def test_over_dots_that_stick_there_is_no_way_and_none_is_known_of_an_object_that_is_lifted(step, known):
    face, states = Face(), Tracker()
    for _ in range(4):
        states.update(face.state(step, 0.1), face.score)
    ways = states.ways()[face.inside]
    assert (np.abs(ways) < 10e-6).all() if known else np.isnan(ways).all()


def test_each_of_two_objects_has_a_motion_of_its_own():
    face, states = Face(), Tracker()
    row, column = np.divmod(np.arange(SIDE**2), SIDE)
    left, right = (column < 5) & (np.abs(row - 6) < 4), (column > 7) & (np.abs(row - 6) < 4)
    face.inside = left | right
    face.score = face.inside.astype(float)
    steps = np.outer(left, [120e-6, 0, 0]) + np.outer(right, [0, -150e-6, -100e-6])
    for frame in range(6):
        found = states.update(face.state(steps, 0.1), face.score)
        np.testing.assert_array_equal(found[face.inside], STICKING)


def test_what_an_object_does_and_which_dots_slip_has_probabilities():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    assert (states.slipping[face.inside] > 0.9).all() and np.isnan(states.slipping[~face.inside]).all()
    held, in_part, slides, rests = states.objects[0].odds
    assert slides > 0.9 and held + in_part + slides + rests == pytest.approx(1)
    assert slip_confidence(2, states.objects) > 0.8 > 0.1 > slip_confidence(0, states.objects)
    assert np.isnan(slip_confidence(0, []))


class Chain:
    """Contacts and slip of frames at 30 a second."""

    def __init__(self, pad):
        self.contacts, self.slip, self.stamp = ContactFinder(pad.cap), SlipEstimator(), 0.0

    def process(self, dots, ways=(np.nan, np.nan)):
        self.stamp += 1 / 30
        contacts = self.contacts.process(dots, find_regions(dots), self.stamp)
        return self.slip.process(dots, contacts, np.broadcast_to(np.asarray(ways, float), (len(dots.ids), 2)), self.stamp)


def with_slipping(dots, share):
    touched = np.flatnonzero(dots.score > 0.5)
    dots.state[touched[:round(share * len(touched))]] = 2
    return dots


def test_unknown_when_nothing_touches(pad):
    estimate = Chain(pad).process(pad.disc(radius=-1e-2))
    assert estimate.state == NONE and np.isnan(estimate.slipping_fraction)
    assert np.isnan(estimate.linear).all() and len(estimate.x) == len(estimate.vy) == 0


def test_states_end_below_where_they_begin(pad):
    chain = Chain(pad)
    shares = [0.0, 0.04, 0.06, 0.04, 0.02, 0.88, 0.92, 0.88, 0.8, 0.0]
    states = [chain.process(with_slipping(pad.disc(radius=8e-3), share)).state for share in shares]
    assert states == [NONE, NONE, INCIPIENT, INCIPIENT, NONE, INCIPIENT, GROSS, GROSS, INCIPIENT, NONE]


@pytest.mark.parametrize('share, state', [(0.3, INCIPIENT), (1.0, GROSS)])
def test_velocity_is_the_objects_way_over_the_dots_that_slip(pad, share, state):
    chain = Chain(pad)
    chain.process(pad.disc(radius=6e-3))
    dots = with_slipping(pad.disc(radius=6e-3), share)
    estimate = chain.process(dots, (60e-6, 0.0))
    assert estimate.state == state and len(estimate.vx) == (dots.state == 2).sum()
    np.testing.assert_allclose(estimate.vx, 1.8e-3)
    np.testing.assert_allclose(estimate.linear, [1.8e-3, 0, 0], atol=1e-12)
    assert np.isnan(estimate.rotation_center).all()
    unknown = chain.process(dots)
    assert unknown.state == state and np.isnan(unknown.linear).all() and np.isnan(unknown.vx).all()


def test_a_turn_has_its_centre(pad):
    chain, dots = Chain(pad), with_slipping(pad.disc(radius=5e-3), 1.0)
    arm = dots.xyz[:, :2] - [1e-3, -0.5e-3]
    ways = 0.02 * np.column_stack([-arm[:, 1], arm[:, 0]])
    assert np.isnan(chain.process(dots, ways).angular).all()  # how long the first frame took is not known
    estimate = chain.process(dots, ways)
    np.testing.assert_allclose(estimate.rotation_center[:2], [1e-3, -0.5e-3], atol=1e-6)
    assert estimate.state == GROSS and estimate.angular[2] == pytest.approx(0.6)


def test_bad_frames_and_arguments(pad):
    slip, dots, ways = SlipEstimator(), pad.disc(), np.zeros((529, 2))
    slip.process(dots, [], ways, 1.0)
    for stamp in (1.0, 0.2, np.nan):
        with pytest.raises(BadFrame):
            slip.process(dots, [], ways, stamp)
    with pytest.raises(BadArgument):
        slip.process(dots, [], ways[:3], 2.0)


@pytest.mark.full
def test_whatever_dots_come_nothing_breaks(pad):
    chain, rng = Chain(pad), np.random.default_rng(0)
    for _ in range(150):
        keep = rng.permutation(529)[:rng.choice([0, 1, 2, 3, 5, 20, 400, 529])]
        score = [rng.normal(0.5, 0.5, 529), np.ones(529), (rng.random(529) < 0.1).astype(float), np.zeros(529)][rng.integers(4)]
        xyz = (pad.rest + rng.normal(0, rng.choice([0, 1e-3]), (529, 3))) * rng.choice([0, 1], p=[0.1, 0.9])
        state = np.where(score > 0.5, rng.choice([1, 2], 529), 0).astype(np.uint8)
        dots = ContactDots(23, 23, keep, xyz[keep], score[keep], state[keep], rng.normal(0, 0.01, (529, 3)))
        regions = find_regions(dots)
        assert all(np.isfinite(loop).all() and len(loop) >= 3 for region in regions for loop in region.outline.loops)
        assert describe(dots, regions).area >= 0
        estimate = chain.process(dots)
        assert len(estimate.x) == len(estimate.vx) == (dots.state == 2).sum()

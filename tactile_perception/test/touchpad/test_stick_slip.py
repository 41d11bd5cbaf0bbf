# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slip of dots and of the object."""
import numpy as np
import pytest

from tactile_perception._core.touchpad import DotLoads, StickSlip
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE
from tactile_perception.core.errors import BadArgument, BadFrame
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
        return DotLoads(xyz=seen, seen=np.ones(count, bool), normal=np.tile([0, 0, 1.0], (count, 1)), force=force, load=self.score)


def test_the_noise_is_learnt_without_contact():
    face, states = Face(), Tracker()
    for _ in range(40):
        states.update(face.state([0, 0, 0], 0.0), np.zeros(SIDE**2))
    assert states.noise == pytest.approx(np.sqrt(2) * 1e-6, rel=0.3)


def test_a_face_that_moves_all_dots_sticks_at_any_friction():
    face, states = Face(), Tracker()
    for frame in range(8):
        found = states.update(face.state([120e-6, 0, -200e-6], 0.1 * frame), face.score)
        np.testing.assert_array_equal(found[face.inside], STICKING)


def _drag_until_it_slips(face, states, friction, speed=150e-6):
    """Stick while moving at speed, m per frame, then slip from one side inwards, dragged unevenly, then all together; return the slipping
    fraction of each frame."""
    fractions, column, uneven = [], np.arange(SIDE**2) % SIDE, np.random.default_rng(0).uniform(0.2, 1.8, SIDE**2)
    for frame in range(14):
        slipping = np.clip((frame - 5) / 4, 0, 1) * 7 > column - 3
        ratio = np.where(slipping, friction, min(0.08 * frame, friction))
        step = np.outer(np.where(slipping, 20e-6 * uneven if frame < 10 else max(6e-6, speed / 50), speed), [1, 0, 0])
        found = states.update(face.state(step, ratio), face.score)
        fractions.append(((found == SLIPPING) & face.inside).sum() / face.inside.sum())
    return fractions


def test_gross_slip_is_reported_although_the_dots_hardly_move():
    face, states = Face(), Tracker()
    fractions = _drag_until_it_slips(face, states, 0.6)
    assert max(fractions[:5]) < 0.05
    assert 0.3 < fractions[7] < 0.8
    assert min(fractions[10:]) > 0.95
    assert states.friction == pytest.approx(0.6, abs=0.1)


@pytest.mark.parametrize('speed', [100e-6, 150e-6])
def test_an_object_that_stops_after_gross_slip_is_at_rest_within_a_tenth_of_a_second(speed):
    face, states = Face(), Tracker()
    assert _drag_until_it_slips(face, states, 0.6, speed)[-1] == 1
    for frame in range(1, 6):
        found = states.update(face.state([0, 0, 0], 0.6), face.score)
        assert frame < 3 or (found[face.inside] == STICKING).all()


def test_continued_sliding_over_dots_that_stopped_by_themselves_is_uncertain():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    for frame in range(60):
        states.update(face.state([6e-6 * 0.7**frame, 0, 0], 0.6), face.score)
        slides, rests = states.objects[0].odds[2:]
        assert slides + rests > 0.99 and (frame < 25 or 0.2 < rests < 0.8)
    assert 0.2 < slip_confidence(2, states.objects) < 0.7 and 0.2 < slip_confidence(0, states.objects) < 0.7


def test_an_object_that_starts_backwards_after_a_stop_sticks():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    for step, ratio in ((0, 0.6), (0, 0.6), (0, 0.6), (-5e-6, 0.57), (-15e-6, 0.5), (-40e-6, 0.35), (-80e-6, 0.1)):
        found = states.update(face.state([step, 0, 0], ratio), face.score)
    assert np.mean(found[face.inside] == STICKING) > 0.95


def test_displacement_in_gross_slip_continues_the_last_motion_with_sticking_dots_for_a_second():
    face, states = Face(), Tracker()
    _drag_until_it_slips(face, states, 0.6)
    for frame in range(34):
        found = states.update(face.state([4e-6, 0, 0], 0.6), face.score)
        displacements = states.displacements()
        assert np.mean(found[face.inside] == SLIPPING) == 1 and np.isnan(displacements[~face.inside]).all()
        if 4 < frame < 24:
            np.testing.assert_allclose(displacements[face.inside], np.tile([146e-6, 0], (49, 1)), atol=8e-6)
    assert np.isnan(displacements).all()


@pytest.mark.parametrize('step, known', [([150e-6, 0, 0], True), ([0, 0, -200e-6], True), ([0, 0, 200e-6], False)])
def test_displacement_over_sticking_dots_is_zero_and_unknown_for_a_lifted_object(step, known):
    face, states = Face(), Tracker()
    for _ in range(4):
        states.update(face.state(step, 0.1), face.score)
    displacements = states.displacements()[face.inside]
    assert (np.abs(displacements) < 10e-6).all() if known else np.isnan(displacements).all()


def test_two_objects_have_separate_motions():
    face, states = Face(), Tracker()
    row, column = np.divmod(np.arange(SIDE**2), SIDE)
    left, right = (column < 5) & (np.abs(row - 6) < 4), (column > 7) & (np.abs(row - 6) < 4)
    face.inside = left | right
    face.score = face.inside.astype(float)
    steps = np.outer(left, [120e-6, 0, 0]) + np.outer(right, [0, -150e-6, -100e-6])
    for frame in range(6):
        found = states.update(face.state(steps, 0.1), face.score)
        np.testing.assert_array_equal(found[face.inside], STICKING)


def test_object_modes_and_slipping_dots_have_probabilities():
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

    def process(self, dots, displacements=(np.nan, np.nan)):
        self.stamp += 1 / 30
        contacts = self.contacts.process(dots, find_regions(dots), self.stamp)
        return self.slip.process(dots, contacts, np.broadcast_to(np.asarray(displacements, float), (len(dots.ids), 2)), self.stamp)


def with_slipping(dots, share):
    touched = np.flatnonzero(dots.score > 0.5)
    dots.state[touched[:round(share * len(touched))]] = 2
    return dots


def test_unknown_when_nothing_touches(pad):
    estimate = Chain(pad).process(pad.disc(radius=-1e-2))
    assert estimate.state == NONE and np.isnan(estimate.slipping_fraction)
    assert np.isnan(estimate.linear).all() and len(estimate.x) == len(estimate.vy) == 0


def test_states_have_hysteresis(pad):
    chain = Chain(pad)
    shares = [0.0, 0.04, 0.06, 0.04, 0.02, 0.88, 0.92, 0.88, 0.8, 0.0]
    states = [chain.process(with_slipping(pad.disc(radius=8e-3), share)).state for share in shares]
    assert states == [NONE, NONE, INCIPIENT, INCIPIENT, NONE, INCIPIENT, GROSS, GROSS, INCIPIENT, NONE]


@pytest.mark.parametrize('share, state', [(0.3, INCIPIENT), (1.0, GROSS)])
def test_the_velocity_is_the_displacement_over_slipping_dots_per_time(pad, share, state):
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


def test_a_rotation_has_its_centre(pad):
    chain, dots = Chain(pad), with_slipping(pad.disc(radius=5e-3), 1.0)
    arm = dots.xyz[:, :2] - [1e-3, -0.5e-3]
    displacements = 0.02 * np.column_stack([-arm[:, 1], arm[:, 0]])
    assert np.isnan(chain.process(dots, displacements).angular).all()  # the duration of the first frame is unknown
    estimate = chain.process(dots, displacements)
    np.testing.assert_allclose(estimate.rotation_center[:2], [1e-3, -0.5e-3], atol=1e-6)
    assert estimate.state == GROSS and estimate.angular[2] == pytest.approx(0.6)


def test_bad_frames_and_arguments(pad):
    slip, dots, displacements = SlipEstimator(), pad.disc(), np.zeros((529, 2))
    slip.process(dots, [], displacements, 1.0)
    for stamp in (1.0, 0.2, np.nan):
        with pytest.raises(BadFrame):
            slip.process(dots, [], displacements, stamp)
    with pytest.raises(BadArgument):
        slip.process(dots, [], displacements[:3], 2.0)


@pytest.mark.full
def test_random_dots_give_valid_results(pad):
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

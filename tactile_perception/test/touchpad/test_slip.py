# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE, planar_twist
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.touchpad.region import ContactDots, describe, find_regions, ContactTracker
from tactile_perception.touchpad.slip import MotionEstimate, ObjectMotion, SlipEstimator


class Chain:
    """Contacts, motion and slip of frames at 30 a second."""

    def __init__(self, pad):
        self.contacts, self.motion, self.slip, self.stamp = ContactTracker(pad.cap), ObjectMotion(23, 23, 0.03), SlipEstimator(), 0.0

    def process(self, dots):
        self.stamp += 1 / 30
        contacts = self.contacts.process(dots, find_regions(dots))
        return self.slip.process(dots, contacts, self.motion.process(dots, self.stamp), self.stamp)


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


def test_incipient_slip_has_its_velocity(pad):
    chain = Chain(pad)
    chain.process(pad.disc(radius=6e-3))
    dots = pad.disc(radius=6e-3)
    touched = dots.score > 0.5
    late = touched & (dots.xyz[:, 0] > 2e-3)
    dots.xyz[touched] += [0.1e-3, 0, 0]
    dots.xyz[late] -= [0.06e-3, 0, 0]
    dots.state[late] = 2
    estimate = chain.process(dots)
    assert estimate.state == INCIPIENT and len(estimate.vx) == late.sum()
    np.testing.assert_allclose(estimate.vx, 1.8e-3, atol=1e-5)
    np.testing.assert_allclose(estimate.linear, [1.8e-3, 0, 0], atol=1e-5)
    assert np.isnan(estimate.rotation_center).all()


@pytest.mark.parametrize('rise, known', [(0.0, True), (0.02e-3, True), (0.1e-3, False)])
def test_velocity_of_an_object_that_is_lifted_is_unknown(pad, rise, known):
    chain = Chain(pad)
    chain.process(pad.disc(radius=6e-3))
    dots = pad.disc(radius=6e-3)
    touched = dots.score > 0.5
    late = touched & (dots.xyz[:, 0] > 2e-3)
    dots.xyz[touched] += [0.1e-3, 0, rise]
    dots.xyz[late] -= [0.06e-3, 0, 0]
    dots.state[late] = 2
    estimate = chain.process(dots)
    assert len(estimate.vx) == late.sum() and np.isfinite(estimate.vx).all() == known == np.isfinite(estimate.linear).all()


def gross(pad, centre, force):
    return loaded(pad.disc(centre=centre, radius=4e-3, state=2), force)


def loaded(dots, force):
    dots.force = np.where((dots.state == 2)[:, None], force(dots.xyz), 0.0)
    return dots


def dragged(xyz):
    return np.tile([2e-3, 0, -5e-3], (len(xyz), 1))


def test_speed_of_a_face_in_gross_slip_is_unknown(pad):
    chain = Chain(pad)
    for k in range(12):
        estimate = chain.process(gross(pad, (0.2e-3 * k - 1e-3, 0), dragged))
    assert estimate.state == GROSS and np.isnan(estimate.linear).all() and np.isnan(estimate.vx).all()


def test_speed_of_a_face_in_gross_slip_is_that_by_which_it_slides_as_far_as_known(pad):
    chain, dots = Chain(pad), gross(pad, (0, 0), dragged)
    chain.process(dots)
    motion = MotionEstimate(None, np.nan, np.full((len(dots.ids), 3), np.nan))
    contacts = chain.contacts.process(dots, find_regions(dots))
    for way in ([0.2e-3, -0.1e-3], [np.nan, np.nan]):
        chain.stamp += 1 / 30
        estimate = chain.slip.process(dots, contacts, motion, chain.stamp, np.tile(way, (len(dots.ids), 1)))
        np.testing.assert_allclose(estimate.linear[:2], 30 * np.array(way))
        np.testing.assert_allclose(estimate.vx, 30 * way[0])


def test_gross_turn_has_a_centre_but_no_speed(pad):
    chain = Chain(pad)
    for _ in range(8):
        estimate = chain.process(gross(pad, (1e-3, -0.5e-3), lambda xyz: np.cross([0, 0, 1], xyz - [1e-3, -0.5e-3, 0])))
    np.testing.assert_allclose(estimate.rotation_center[:2], [1e-3, -0.5e-3], atol=0.1e-3)
    assert np.isnan(estimate.linear).all() and np.isnan(estimate.vx).all()


def test_twist_of_a_field():
    place = np.random.default_rng(0).uniform(-4e-3, 4e-3, (30, 2))
    centre = np.array([1e-3, 2e-3])
    arm = place - centre
    linear, turn, found = planar_twist(place, 0.7 * np.stack([-arm[:, 1], arm[:, 0]], axis=1))
    assert turn == pytest.approx(0.7)
    np.testing.assert_allclose(found, centre, atol=1e-9)
    np.testing.assert_allclose(linear, [0.7 * 2e-3, -0.7 * 1e-3], atol=1e-9)
    linear, turn, found = planar_twist(place, np.tile([1e-3, -2e-3], (30, 1)))
    np.testing.assert_allclose([*linear, turn], [1e-3, -2e-3, 0], atol=1e-12)
    assert np.isnan(found).all()


def test_bad_frames_and_arguments(pad):
    slip, dots = SlipEstimator(), pad.disc()
    still = MotionEstimate(None, np.nan, np.full((529, 3), np.nan))
    slip.process(dots, [], still, 1.0)
    for stamp in (1.0, 0.2, np.nan):
        with pytest.raises(BadFrame):
            slip.process(dots, [], still, stamp)
    with pytest.raises(BadArgument):
        slip.process(dots, [], MotionEstimate(None, np.nan, np.zeros((3, 3))), 2.0)


def test_whatever_dots_come_nothing_breaks(pad):
    chain, rng = Chain(pad), np.random.default_rng(0)
    for _ in range(150):
        keep = rng.permutation(529)[:rng.choice([0, 1, 2, 3, 5, 20, 400, 529])]
        score = [rng.normal(0.5, 0.5, 529), np.ones(529), (rng.random(529) < 0.1).astype(float), np.zeros(529)][rng.integers(4)]
        xyz = (pad.rest + rng.normal(0, rng.choice([0, 1e-3]), (529, 3))) * rng.choice([0, 1], p=[0.1, 0.9])
        state = np.where(score > 0.5, rng.choice([1, 2], 529), 0).astype(np.uint8)
        dots = ContactDots(23, 23, keep, xyz[keep], pad.rest[keep], score[keep], state[keep], rng.normal(0, 0.01, (len(keep), 3)))
        regions = find_regions(dots)
        assert all(np.isfinite(loop).all() and len(loop) >= 3 for region in regions for loop in region.outline.loops)
        assert describe(dots, regions).area >= 0
        estimate = chain.process(dots)
        assert len(estimate.x) == len(estimate.vx) == (dots.state == 2).sum()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.touchpad.region import ContactDots, ContactFinder, describe, find_regions
from tactile_perception.touchpad.slip import SlipEstimator


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

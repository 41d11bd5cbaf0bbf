# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE
from tactile_perception.touchpad.region import ContactFinder, find_regions


def discs(pad, *centres, radius=2.2e-3, **more):
    distance = np.min([np.hypot(*(pad.rest[:, :2] - centre).T) for centre in centres], axis=0) - radius
    return pad.pressed(distance, np.full(529, 11e-3), **more)


class Finder(ContactFinder):
    """Contacts of frames at 30 a second."""

    stamp_s = 0.0

    def see(self, dots):
        self.stamp_s += 1 / 30
        return self.process(dots, find_regions(dots), self.stamp_s)


def test_a_fast_drag_keeps_the_number(pad):
    finder = Finder(pad.cap)
    assert [finder.see(discs(pad, (x, 0)))[0].id for x in (0, 4.5e-3, 0)] == [1, 1, 1]


def test_two_touches_keep_theirs_when_one_goes(pad):
    finder, both = Finder(pad.cap), discs(pad, (-5e-3, 0), (5e-3, 0))
    first = finder.see(discs(pad, (-5e-3, 0)))[0].id
    places = {contact.id: contact.position[0] for contact in finder.see(both)}
    assert places[first] == pytest.approx(-5e-3, abs=0.1e-3)
    for lost in (1, 5):
        for _ in range(lost):
            assert finder.see(discs(pad, (5e-3, 0)))[0].id in set(places) - {first}
        assert (first in [contact.id for contact in finder.see(both)]) == (lost == 1)


def test_two_joined_discs_are_ambiguous_and_one_or_a_ring_is_not(pad):
    assert Finder(pad.cap).see(discs(pad, (-3.6e-3, 0), (3.6e-3, 0), radius=3.7e-3))[0].flags == AMBIGUOUS
    assert Finder(pad.cap).see(pad.disc())[0].flags == 0
    assert Finder(pad.cap).see(pad.ring())[0].flags == 0


def test_edge_and_range_are_flagged(pad):
    finder = Finder(pad.cap, calibrated_depth=3e-3, calibrated_radius=5e-3)
    assert finder.see(pad.disc(height=11e-3))[0].flags == 0
    assert finder.see(pad.disc(height=9e-3))[0].flags == OUT_OF_RANGE
    assert finder.see(pad.disc(centre=(6e-3, 0)))[0].flags == OUT_OF_RANGE
    assert Finder(pad.cap).see(pad.disc(centre=(10e-3, 0)))[0].flags & AT_EDGE

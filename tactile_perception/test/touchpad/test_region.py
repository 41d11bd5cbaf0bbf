# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.estimates import AMBIGUOUS, AT_EDGE, OUT_OF_RANGE
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.region import ContactDots, ContactFinder, describe, find_regions


def block(pad, angle, length=12e-3, width=7e-3):
    x, y = pad.rest[:, :2].T
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    distance = np.maximum(np.abs(along) - length / 2, np.abs(across) - width / 2)
    return pad.pressed(distance, np.full(len(x), 10e-3))


def test_nothing_touches(pad):
    dots = pad.disc(radius=-1e-2)
    assert find_regions(dots) == []
    estimate = describe(dots, [])
    assert (estimate.area, estimate.outlines, estimate.holes) == (0, [], [])
    assert len(estimate.dot_state) == 529 and not estimate.dot_state.any()
    for name in ('centroid', 'normal', 'orientation', 'major_axis', 'motion_rotation', 'motion_interval'):
        assert np.isnan(getattr(estimate, name)).all()


def test_one_dot_is_a_region(pad):
    dots = pad.disc(radius=0.3e-3)
    region, = find_regions(dots)
    assert region.members.sum() == 1
    assert describe(dots, [region]).area < 1.5e-6


def test_disc_is_described(pad):
    dots = pad.disc(centre=(1e-3, -2e-3), radius=5e-3, noise=20e-6)
    estimate = describe(dots, find_regions(dots))
    assert estimate.area == pytest.approx(np.pi * 25e-6, rel=0.04)
    np.testing.assert_allclose(estimate.centroid, [1e-3, -2e-3, 11e-3], atol=0.1e-3)
    assert estimate.normal[2] > 0.995 and np.linalg.norm(estimate.normal) == pytest.approx(1)
    assert estimate.major_axis == pytest.approx(10e-3, rel=0.04)
    assert np.isnan(estimate.orientation)


@pytest.mark.parametrize('degrees', [-80, -45, 0, 10, 45, 90])
def test_block_has_its_direction(pad, degrees):
    dots = block(pad, np.radians(degrees))
    estimate = describe(dots, find_regions(dots))
    assert -np.pi / 2 < estimate.orientation <= np.pi / 2
    error = (np.degrees(estimate.orientation) - degrees + 90) % 180 - 90
    assert abs(error) < 2
    assert estimate.area == pytest.approx(84e-6, rel=0.05)
    assert estimate.major_axis / estimate.minor_axis == pytest.approx(12 / 7, rel=0.06)


def test_ring_has_a_hole_and_no_direction(pad):
    dots = pad.ring()
    region, = find_regions(dots)
    estimate = describe(dots, [region])
    assert (len(estimate.outlines), len(estimate.holes)) == (1, 1)
    assert estimate.area == pytest.approx(np.pi * (42.25 - 12.25) * 1e-6, rel=0.04)
    assert np.isnan(estimate.orientation)
    np.testing.assert_array_equal(region.members, dots.score > 0.5)


def test_refuses_what_is_not_finite(pad):
    dots = pad.disc()
    for name in ('xyz', 'score'):
        values = {key: getattr(dots, key).copy() for key in ('xyz', 'score')}
        values[name][7] = np.nan
        with pytest.raises(BadArgument, match=name):
            ContactDots(23, 23, dots.ids, values['xyz'], values['score'], dots.state)
    with pytest.raises(BadArgument):
        find_regions(ContactDots(5, 5, dots.ids, dots.xyz, dots.score, dots.state))


def test_two_dots_that_nearly_touch_are_no_region_between_them(pad):
    """Two neighbours brought down to half a score: the cubic between them is over it, beside a region there is."""
    dots = pad.disc(radius=3e-3)
    dots.score[[14 * 23 + 13, 14 * 23 + 14]] = 0.5
    assert len(find_regions(dots)) == 1


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

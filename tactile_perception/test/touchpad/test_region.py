# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.region import ContactDots, describe, find_regions


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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, both, disc, picture, ring
from tactile_perception.common.surface import axes
from tactile_perception.taxel.array import SoftPad
from tactile_perception.taxel.regions import find_regions, joined, without
from tactile_perception.taxel.score import ContactScore

SCORE = ContactScore(ARRAY, SoftPad())


def regions_of(inside, load=60.0):
    image = picture(inside, load)
    return find_regions(SCORE.compute(image, 0.05), image, ARRAY)


@pytest.mark.parametrize('angle', [0.0, 0.3, -0.7, 1.2])
def test_centroid_and_direction_of_a_bar(angle):
    region = regions_of(bar(1.23, -0.61, angle)).all[0]
    assert region.moments.centroid[:2] == pytest.approx([1.23e-3, -0.61e-3], abs=0.1e-3)
    assert region.moments.area == pytest.approx(160e-6, rel=0.06)
    spread = region.moments.spread
    assert 0.5 * np.arctan2(2 * spread[0, 1], spread[0, 0] - spread[1, 1]) == pytest.approx(angle, abs=np.radians(0.2))


def test_ring_has_one_hole():
    regions = regions_of(ring())
    assert len(regions.all) == 1 and len(regions.all[0].outlines[0].holes) == 1
    assert regions.total.area == pytest.approx(np.pi * 65e-6, rel=0.09)


def test_hole_is_found_to_a_part_of_a_taxel():
    hole = regions_of(ring(inner=5.0, outer=11.0)).all[0].outlines[0].holes[0]
    assert np.hypot(*hole[:, :2].T) == pytest.approx(np.full(len(hole), 5e-3), abs=0.4e-3)


@pytest.mark.parametrize('inside', [disc(0.3, 0.2), bar(length=10, width=10), ring()])
def test_round_and_square_shapes_have_no_direction(inside):
    regions = regions_of(inside)
    region = regions.all[0]
    assert np.isnan(axes(region.moments, region.outlines[0].loops, 0.5e-3)[2])


def test_two_fingers_with_their_forces():
    regions = regions_of(both(bar(-8, 0, 0, 8, 8), bar(8, 0, 0, 8, 6)))
    assert [region.moments.centroid[0] for region in regions.all] == pytest.approx([-8e-3, 8e-3], abs=1e-4)
    assert [region.force for region in regions.all] == pytest.approx([60 * 64e-6, 60 * 48e-6], rel=0.02)


def test_one_taxel_and_none():
    image = np.zeros((44, 44), np.float32)
    assert not find_regions(image, image, ARRAY).all
    image[10, 12] = 1.0
    region = find_regions(image, image, ARRAY).all[0]
    assert region.count == 1 and region.moments.centroid[:2] == pytest.approx([-9.5e-3, -11.5e-3])


def test_a_taxel_that_hardly_exceeds_the_border_is_no_region():
    image = np.zeros((44, 44), np.float32)
    image[10, 12] = 0.6
    assert not find_regions(image, image, ARRAY).all
    image[10, 13] = 0.9
    assert find_regions(image, image, ARRAY).all[0].count == 2


def pads(gap):
    """Two squares of 8 mm with gap, mm, between them."""
    return both(bar(-4 - gap / 2, 0, 0, 8, 8), bar(4 + gap / 2, 0, 0, 8, 6))


@pytest.mark.parametrize(('gap', 'light', 'count'), [(2.0, 0.0, 1), (4.0, 0.0, 2), (4.0, 1e3, 1), (8.0, 1e3, 2)])
def test_regions_that_one_object_can_make_are_one(gap, light, count):
    apart = regions_of(pads(gap))
    regions = joined(apart, 2.0, light)
    assert len(apart.all) == 2 and len(regions.all) == count
    assert sorted(set(np.unique(regions.labels)) - {0}) == sorted(region.label for region in regions.all)
    assert regions.total.area == pytest.approx(apart.total.area) and len([o for r in regions.all for o in r.outlines]) == 2
    assert sum(region.force for region in regions.all) == pytest.approx(60 * 112e-6, rel=0.05)


def test_a_joined_region_is_that_of_its_pieces():
    apart = regions_of(pads(4.0))
    region, = joined(apart, 2.0, 1e3).all
    assert region.count == sum(piece.count for piece in apart.all) and region.peak == max(piece.peak for piece in apart.all)
    assert region.box[1].start == min(piece.box[1].start for piece in apart.all)
    assert region.moments.centroid[:2] == pytest.approx(apart.total.centroid[:2])


def test_one_region_is_left_as_it_is():
    regions = regions_of(ring())
    assert joined(regions, 2.0, 1e3) is regions


def test_a_region_that_is_taken_out_leaves_no_trace():
    regions = regions_of(both(disc(-11, 0, 5), disc(11, 0, 7)))
    large, small = regions.all
    kept = without(regions, [large.label])
    assert kept.all == [small] and (kept.labels[regions.labels != large.label] == regions.labels[regions.labels != large.label]).all()
    assert not (kept.near == large.label).any() and (kept.touched == (regions.labels == small.label)).all()
    assert without(regions, []) is regions

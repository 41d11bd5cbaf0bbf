# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from scipy import ndimage
from taxel_pictures import ARRAY, bar, both, disc, moments, picture, ring

from tactile_perception._core.taxel import LEVEL
from tactile_perception.common.surface import axes
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.region import ContactScore, find_regions

SCORE = ContactScore(ARRAY, SoftPad())


def regions_of(inside, load=60.0, reach=0.0):
    image = picture(inside, load)
    return find_regions(SCORE.compute(image, 0.05), image, ARRAY, reach)


@pytest.mark.parametrize('angle', [0.0, 0.3, -0.7, 1.2])
def test_centroid_and_direction_of_a_bar(angle):
    region = regions_of(bar(1.23, -0.61, angle)).all[0]
    assert moments(region).centroid[:2] == pytest.approx([1.23e-3, -0.61e-3], abs=0.1e-3)
    assert moments(region).area == pytest.approx(160e-6, rel=0.06)
    (xx, xy, yy), (x, y) = moments(region).second / moments(region).area, moments(region).centroid[:2]
    assert 0.5 * np.arctan2(2 * (xy - x * y), xx - x * x - yy + y * y) == pytest.approx(angle, abs=np.radians(0.2))


def test_a_hole_is_found_with_subtaxel_accuracy():
    hole = regions_of(ring(inner=5.0, outer=11.0)).all[0].holes[0]
    assert np.hypot(*hole[:, :2].T) == pytest.approx(np.full(len(hole), 5e-3), abs=0.4e-3)


@pytest.mark.parametrize('inside', [disc(0.3, 0.2), bar(length=10, width=10), ring()])
def test_round_and_square_shapes_have_no_direction(inside):
    region = regions_of(inside).all[0]
    assert np.isnan(axes(moments(region), region.outlines + region.holes, 0.5e-3)[2])


def test_two_fingers_with_their_forces():
    regions = regions_of(both(bar(-8, 0, 0, 8, 8), bar(8, 0, 0, 8, 6)))
    assert [moments(region).centroid[0] for region in regions.all] == pytest.approx([-8e-3, 8e-3], abs=1e-4)
    assert [region.force for region in regions.all] == pytest.approx([60 * 64e-6, 60 * 48e-6], rel=0.02)


def test_one_taxel_and_none():
    image = np.zeros((44, 44), np.float32)
    assert not find_regions(image, image, ARRAY).all
    image[10, 12] = 1.0
    region = find_regions(image, image, ARRAY).all[0]
    assert region.count == 1 and moments(region).centroid[:2] == pytest.approx([-9.5e-3, -11.5e-3])


def test_a_taxel_just_above_the_level_is_no_region():
    image = np.zeros((44, 44), np.float32)
    image[10, 12] = 0.6
    assert not find_regions(image, image, ARRAY).all
    image[10, 13] = 0.9
    assert find_regions(image, image, ARRAY).all[0].count == 2


def pads(gap):
    """Two squares of 8 mm with a gap, mm, between them."""
    return both(bar(-4 - gap / 2, 0, 0, 8, 8), bar(4 + gap / 2, 0, 0, 8, 6))


@pytest.mark.parametrize(('gap', 'count'), [(2.0, 1), (4.0, 2)])
def test_pieces_nearer_than_the_pads_thickness_are_one_region(gap, count):
    apart, regions = regions_of(pads(gap)), regions_of(pads(gap), reach=2.0)
    assert len(apart.all) == 2 and len(regions.all) == count
    assert sorted(set(np.unique(regions.labels)) - {0}) == sorted(region.label for region in regions.all)
    assert moments(*regions.all).area == pytest.approx(moments(*apart.all).area) and len([o for r in regions.all for o in r.outlines]) == 2
    assert sum(region.force for region in regions.all) == pytest.approx(60 * 112e-6, rel=0.05)
    assert sum(region.count for region in regions.all) == sum(piece.count for piece in apart.all)
    assert moments(*regions.all).centroid[:2] == pytest.approx(moments(*apart.all).centroid[:2])


@pytest.mark.parametrize('size', [(1, 1), (1, 9), (7, 1), (2, 2), (13, 6), (44, 44)])
@pytest.mark.parametrize('seed', range(3))
def test_regions_of_any_score_have_consistent_taxels_loads_and_integrals(seed, size):
    rng = np.random.default_rng(seed)
    rough = ndimage.gaussian_filter(rng.normal(0, 1, size), 1.5, mode='constant')
    score = np.clip(0.4 + 3 * rough, 0, 1).astype(np.float32)
    pressure = (3e4 * score + 1e3 * rng.normal(0, 1, size)).astype(np.float32)
    regions = find_regions(score, pressure, TaxelArray(*size, 1e-3))
    assert (regions.touched == (score > LEVEL)).all() and (regions.near[regions.touched] == regions.labels[regions.touched]).all()
    for region in regions.all:
        mine, near = regions.labels == region.label, regions.near == region.label
        assert region.count == mine.sum() and region.at_edge == (mine.sum() > mine[1:-1, 1:-1].sum())
        load = np.where(near, np.maximum(pressure, 0), 0).astype(float)
        assert [region.force, region.peak] == pytest.approx([1e-6 * load.sum(), load.max()], rel=1e-6, abs=1e-15)
        loops = [(1, outline) for outline in region.outlines] + [(-1, hole) for hole in region.holes]
        found = [(sign, cv2.moments(points[:, None, :2].astype(np.float32) * np.float32(1e3))) for sign, points in loops]
        sums = np.array([sum(sign * one[name] for sign, one in found) for name in ('m00', 'm10', 'm01', 'm20', 'm11', 'm02')])
        own = moments(region)
        assert [1e6 * own.area, *1e9 * own.first[:2], *1e12 * own.second] == pytest.approx(sums.tolist(), rel=1e-4, abs=1e-3)


def test_only_the_largest_of_too_many_regions_are_reported():
    score = np.zeros((40, 40), np.float32)
    score[::3, ::3] = 1
    score[9, 9:12] = 1
    regions = find_regions(score, score, TaxelArray(40, 40, 1e-3))
    assert regions.broken and len(regions.all) == 64 and regions.all[0].count == 4


@pytest.mark.parametrize('load', [10.0, 60.0, 250.0])
def test_border_does_not_depend_on_the_load(load):
    assert (SCORE.compute(picture(bar(), load), 0.05) > LEVEL).sum() == pytest.approx(160, abs=16)


def test_tilted_face_keeps_its_border():
    y, x = np.mgrid[:44, :44]
    tilted = picture(bar()) * (1 + 0.03 * (x - 21.5)).astype(np.float32)
    level, tilt = (SCORE.compute(image, 0.05) > LEVEL for image in (picture(bar()), tilted))
    assert (level ^ tilt).sum() <= 8


def test_ring_has_a_hole_and_a_rough_face_none():
    assert SCORE.compute(picture(ring()), 0.05)[21, 21] < 0.2
    y, x = np.mgrid[:44, :44]
    rough = picture(disc()) * (1 + 0.3 * np.cos(2 * x) * np.cos(2 * y)).astype(np.float32)
    assert (SCORE.compute(rough, 0.05)[17:27, 17:27] > LEVEL).all()

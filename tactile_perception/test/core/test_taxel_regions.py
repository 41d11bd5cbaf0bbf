# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel taxel_regions (src/taxel/taxel_regions.cpp) against SciPy's labels, plain loops and closed forms."""
import cv2
import numpy as np
import pytest
from scipy import ndimage
from tactile_perception._core import taxel_regions

RULE = {'level': 0.5, 'pitch': 1e-3, 'most': 64, 'around': 2}


def any_score(seed, size):
    """A random score of blobs, and pressure, some of it negative."""
    rng = np.random.default_rng(seed)
    rough = ndimage.gaussian_filter(rng.normal(0, 1, size), 1.5, mode='constant')
    score = np.clip(0.4 + 3 * rough, 0, 1).astype(np.float32)
    return score, (3e4 * score + 1e3 * rng.normal(0, 1, size)).astype(np.float32)


@pytest.mark.parametrize('size', [(1, 1), (1, 9), (7, 1), (2, 2), (13, 6), (44, 44)])
@pytest.mark.parametrize('seed', range(4))
def test_labels_and_loads_are_those_of_plain_loops(seed, size):
    score, pressure = any_score(seed, size)
    labels, near, broken, table, *_ = taxel_regions(score, pressure, **RULE)
    expected, count = ndimage.label(score > 0.5)
    pairs = {(int(one), int(other)) for one, other in zip(labels.ravel(), expected.ravel())}
    assert len(pairs) == count + bool((expected == 0).any()) and not broken
    assert {one for one, _ in pairs} - {0} == {int(row[0]) for row in table}  # one outline joins taxels that touch at a corner
    around = ndimage.maximum_filter(labels, 5, mode='constant')
    np.testing.assert_array_equal(near, np.where(labels > 0, labels, around))
    assert len(table) == len({row[0] for row in table.tolist()}) <= count
    for label, taxels, top, left, bottom, right, force, peak, *_ in table.tolist():
        mine = labels == label
        box, = ndimage.find_objects(mine.astype(int))
        assert (taxels, top, left, bottom, right) == (mine.sum(), box[0].start, box[1].start, box[0].stop, box[1].stop)
        load = np.where(near == label, np.maximum(pressure, 0), 0).astype(float)
        assert [force, peak] == pytest.approx([1e-6 * load.sum(), load.max()], rel=1e-9, abs=1e-15)


@pytest.mark.parametrize('seed', range(4))
def test_integrals_are_those_of_the_outlines(seed):
    score, pressure = any_score(seed, (31, 40))
    *_, table, places, points, start, region = taxel_regions(score, pressure, **RULE)
    np.testing.assert_allclose(points[:, :2], 1e-3 * (places[:, ::-1] - [19.5, 15.0]), atol=1e-12)
    for number, row in enumerate(table):
        sums = np.zeros(6)
        for first, last in zip(start[:-1][region == number], start[1:][region == number]):
            found = cv2.moments(points[first:last, None, :2].astype(np.float32) * np.float32(1e3))
            hole = 1 if first == start[:-1][region == number][0] else -1
            sums += hole * np.array([found[name] for name in ('m00', 'm10', 'm01', 'm20', 'm11', 'm02')])
        size = np.array([1e-6, 1e-9, 1e-9, 1e-12, 1e-12, 1e-12])
        np.testing.assert_allclose(row[8:], sums * size, rtol=1e-4, atol=1e-3 * size.max())


def test_a_block_has_its_corners_cut():
    score = np.zeros((20, 30), np.float32)
    score[5:9, 20:26] = 1
    row, = taxel_regions(score, score, **RULE)[3]
    corner, legs = np.array([3.0, 2.0]), 0.5  # half sides, and the triangles that are missing, in taxels
    area = 4 * corner.prod() - 4 * legs**2 / 2
    moved = np.array([22.5 - 14.5, 6.5 - 9.5])
    lost = np.array([4 * legs**2 / 2 * (legs**2 / 18 + (c - legs / 3)**2) for c in corner])
    spread = 4 * corner.prod() * corner**2 / 3 - lost
    assert row[8:11] == pytest.approx([area * 1e-6, *(area * moved * 1e-9)], rel=1e-9)
    assert row[[11, 13]] == pytest.approx((spread + area * moved**2) * 1e-12, rel=1e-9)
    assert row[12] == pytest.approx(area * moved.prod() * 1e-12, rel=1e-9)


def test_blocks_that_meet_at_a_corner_are_one_region_with_the_load_of_both():
    score = np.full((20, 20), 0.4, np.float32)
    score[3:6, 3:6] = score[6:14, 6:14] = 1
    labels, near, _, table, *_ = taxel_regions(score, score, **RULE)
    row, = table
    assert row[1:6].tolist() == [9 + 64, 3, 3, 14, 14] and len(np.unique(labels)) == 2
    assert row[6] == pytest.approx(1e-6 * score[near > 0].sum()) and row[6] > 73e-6
    assert row[8] == pytest.approx(((2 + 5 / 3)**2 + (7 + 5 / 3)**2) * 1e-6, rel=0.03)  # sides to where the score is 0.5


def test_of_too_many_regions_the_largest_are_told():
    score = np.zeros((20, 20), np.float32)
    score[::2, ::2] = 1
    score[4, 4:7] = 1
    *_, broken, table, _, _, _, region = taxel_regions(score, score, **RULE | {'most': 7})
    assert broken and len(table) == 7 and table[0, 1] == 3 and region.tolist() == list(range(7))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.region import ContactScore, ContactTracker, find_regions
from taxel_pictures import ARRAY, bar, both, picture

SCORE = ContactScore(ARRAY, SoftPad())


def assigned(numbers, inside):
    image = picture(inside)
    regions = find_regions(SCORE.compute(image, 0.05), image, ARRAY)
    found = numbers.assign(regions)
    return {one.number: (round(float(region.moments.centroid[0]), 3), one.merged) for one, region in zip(found, regions.all)}


def two(gap, more=0.0):
    """Two pads gap mm apart; more: mm by which the left one is longer."""
    return both(bar(-4 - gap / 2, 0, 0, 8, 8 + more), bar(4 + gap / 2, 0, 0, 8, 8 - more))


@pytest.mark.parametrize('more', [0.0, 1.0, -1.0])
def test_two_regions_merge_and_part_with_their_numbers_though_the_larger_one_changes(more):
    numbers = ContactTracker()
    seen = [assigned(numbers, two(gap)) for gap in (8, 6, 5, 5, 5, 0, 0)] + [assigned(numbers, two(gap, more)) for gap in (5, 6, 8)]
    assert sorted(seen[0]) == sorted(seen[4]) == sorted(seen[-1]) == [1, 2]
    assert {n: np.sign(at[0]) for n, at in seen[0].items()} == {n: np.sign(at[0]) for n, at in seen[-1].items()}
    assert len(seen[5]) == 1 and list(seen[5].values())[0][1]


def test_a_jump_and_a_gap_make_a_new_contact():
    numbers = ContactTracker()
    assert list(assigned(numbers, bar(-12, length=10))) == [1]
    assert list(assigned(numbers, bar(12, length=10))) == [2]
    assert assigned(numbers, lambda x, y: x > 1e9) == {}
    assert list(assigned(numbers, bar(12, length=10))) == [3]


def told(tracker, inside, least):
    image = picture(inside)
    regions = find_regions(SCORE.compute(image, 0.05), image, ARRAY)
    return [one.reported for one in tracker.assign(regions, least)]


def test_a_light_contact_beside_another_is_told_when_it_lasts():
    tracker, pieces = ContactTracker(), two(8)
    assert told(tracker, pieces, 100.0) == [True, False]
    assert told(tracker, pieces, 100.0) == [True, True]
    tracker.reset()
    assert told(tracker, pieces, 50.0) == [True, True]


def test_pieces_of_a_contact_that_ends_are_not_told():
    tracker = ContactTracker()
    for _ in range(3):
        assert told(tracker, bar(0, 0, 0, 24, 8), 100.0) == [True]
    assert told(tracker, two(8), 100.0).count(True) == 1

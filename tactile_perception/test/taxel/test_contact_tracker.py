# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.region import ContactScore, ContactTracker, find_regions
from taxel_pictures import ARRAY, bar, both, picture

SCORE = ContactScore(ARRAY, SoftPad())


def assigned(numbers, inside):
    image = picture(inside)
    regions = find_regions(SCORE.compute(image, 0.05), image, ARRAY)
    found = numbers.assign(regions)
    return {one.number: (round(float(region.moments.centroid[0]), 3), one.merged) for one, region in zip(found, regions.all)}


def two(gap):
    """Two pads gap mm apart."""
    return both(bar(-4 - gap / 2, 0, 0, 8, 8), bar(4 + gap / 2, 0, 0, 8, 8))


def test_two_regions_merge_into_one_that_says_so_until_they_part():
    numbers = ContactTracker()
    seen = [assigned(numbers, two(gap)) for gap in (8, 6, 5, 5, 5, 0, 0, 5, 6, 8)]
    assert all(sorted(found) == [1, 2] for found in seen[:5])
    (kept, (_, merged)), = seen[5].items()
    assert merged and kept in (1, 2) and seen[6].keys() == {kept}
    for found in seen[-3:]:
        assert sorted(found) == [kept, 3] and not any(merged for _, merged in found.values())


def test_a_jump_and_a_gap_make_a_new_contact():
    numbers = ContactTracker()
    assert list(assigned(numbers, bar(-12, length=10))) == [1]
    assert list(assigned(numbers, bar(12, length=10))) == [2]
    assert assigned(numbers, lambda x, y: x > 1e9) == {}
    assert list(assigned(numbers, bar(12, length=10))) == [3]


def estimated(tracker, inside, least):
    image = picture(inside)
    regions = find_regions(SCORE.compute(image, 0.05), image, ARRAY)
    return [one.reported for one in tracker.assign(regions, least)]


def test_a_light_contact_beside_another_is_estimated_when_it_lasts():
    tracker, pieces = ContactTracker(), two(8)
    assert estimated(tracker, pieces, 100.0) == [True, False]
    assert estimated(tracker, pieces, 100.0) == [True, True]
    tracker.reset()
    assert estimated(tracker, pieces, 50.0) == [True, True]


def test_pieces_of_a_contact_that_ends_are_not_estimated():
    tracker = ContactTracker()
    for _ in range(3):
        assert estimated(tracker, bar(0, 0, 0, 24, 8), 100.0) == [True]
    assert estimated(tracker, two(8), 100.0).count(True) == 1

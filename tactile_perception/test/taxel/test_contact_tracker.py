# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from taxel_pictures import ARRAY, bar, both, moments, picture

from tactile_perception._core.common import ContactTracker
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.region import ContactScore, find_regions

SCORE = ContactScore(ARRAY, SoftPad())


class Tracker(ContactTracker):
    """Contacts of pictures at 100 a second."""

    stamp_s = 0.0

    def see(self, inside):
        """Contacts by number."""
        self.stamp_s += 0.01
        image = picture(inside)
        regions = find_regions(SCORE.compute(image, 0.05), image, ARRAY)
        found = self.assign(regions.labels, [(region.label, moments(region)) for region in regions.all], 1.5e-3, self.stamp_s)
        return {one.number: one for one in found}


def two(gap):
    """Two pads gap mm apart."""
    return both(bar(-4 - gap / 2, 0, 0, 8, 8), bar(4 + gap / 2, 0, 0, 8, 8))


def test_two_regions_merge_into_one_that_is_flagged_until_they_separate():
    tracker = Tracker()
    for gap in (8, 6, 5, 5, 5):
        assert sorted(tracker.see(two(gap))) == [1, 2]
    for _ in range(12):
        (kept, found), = tracker.see(two(0)).items()
        assert found.merged and kept in (1, 2)
    for gap in (5, 6, 8):
        found = tracker.see(two(gap))
        assert sorted(found) == [kept, 3] and not any(one.merged for one in found.values())


def test_a_new_contact_of_several_regions_is_not_flagged_as_merged():
    tracker = Tracker()
    assert len(tracker.see(two(5))) == 2
    assert not any(one.merged for one in tracker.see(two(0)).values())


def test_a_jump_or_a_gap_of_more_than_a_tenth_of_a_second_starts_a_new_contact():
    tracker, nothing = Tracker(), lambda x, y: x > 1e9
    assert list(tracker.see(bar(-12, length=10))) == [1]
    assert list(tracker.see(bar(12, length=10))) == [2]
    for gap, number in ((5, 2), (12, 3)):
        for _ in range(gap):
            assert tracker.see(nothing) == {}
        assert list(tracker.see(bar(12, length=10))) == [number]
    tracker.reset()
    assert list(tracker.see(bar(12, length=10))) == [4]


def test_a_contact_is_persistent_after_20_ms():
    tracker = Tracker()
    assert [one.is_persistent for _ in range(4) for one in tracker.see(bar(0)).values()] == [False, False, True, True]


def test_any_labels_are_tracked():
    tracker, rng = ContactTracker(), np.random.default_rng(0)
    whole = moments(*find_regions(*[np.ones((44, 44), np.float32)] * 2, ARRAY).all)
    for k in range(50):
        labels = rng.integers(0, 9, [(6, 7), (44, 44)][rng.integers(2)]) * rng.integers(0, 2)
        names = rng.permutation(9)[:rng.integers(0, 9)] + 1
        found = tracker.assign(labels, [(int(name), whole) for name in names], 1e-3, 0.04 * k)
        assert len({one.number for one in found}) == len(found) == len(names)

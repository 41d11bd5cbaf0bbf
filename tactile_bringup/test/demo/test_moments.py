# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_bringup.demo.summary import Moments, Reading


def image(k):
    return np.full((2, 2, 3), k, np.uint8)


def test_the_best_frame_of_each_moment_is_kept():
    moments = Moments()
    for k, area in enumerate((0.0, 1e-5, 9e-5, 3e-5, 0.0)):
        slip = 'gross slip' if k == 3 else 'no slip'
        moments.add(Reading(float(k), area=area, states=(9, 1, k), slip=slip), image(k))
    found = moments.pictures()
    assert list(found) == ['first', 'largest_contact', 'most_slip', 'last']
    assert [p.stamp_s for p in found.values()] == [0.0, 2.0, 3.0, 4.0]
    assert found['most_slip'].image[0, 0, 0] == 3

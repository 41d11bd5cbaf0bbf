# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_bringup.visualization.orbit_view import OrbitView, view_of

BOX = np.array([(x, y, z) for x in (-0.03, 0.03) for y in (-0.02, 0.02) for z in (0.0, 0.01)])


def test_the_focal_point_is_in_the_middle_and_the_view_is_45_degrees_high():
    view = OrbitView(2.0, (1.0, 0.0, 0.0), yaw=0.0, pitch=0.0)  # the camera stands at x = 3 and looks along -x
    half = 2.0 * np.tan(np.radians(22.5))
    places, depth = view.project(np.array([(1.0, 0, 0), (1.0, 0, half), (1.0, half, 0), (2.0, 0, 0)]), (600, 400))
    assert places == pytest.approx(np.array([(300, 200), (300, 0), (500, 200), (300, 200)]), abs=1e-6)
    assert depth == pytest.approx([2, 2, 2, 1])


@pytest.mark.parametrize('size', [(700, 860), (1300, 860), (300, 200)])
def test_the_nearest_view_of_all_points_touches_the_margin_on_both_sides(size):
    places, _ = view_of(BOX, size, filled=0.8).project(BOX, size)
    share = places / np.array(size) * 2 - 1
    low, high = share.min(axis=0), share.max(axis=0)
    assert high.max() == pytest.approx(0.8, abs=0.01) and low == pytest.approx(-high, abs=0.01)

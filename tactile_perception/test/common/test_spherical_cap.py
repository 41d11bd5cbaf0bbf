# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.spherical_cap import Cap, sphere_ranges
from tactile_perception.errors import BadArgument

RAYS = np.array([[0, 0, 1.0], [0, 1.0, 0]])


@pytest.mark.parametrize('origin', [np.zeros(3), np.zeros((2, 3))])
def test_near_and_far_side_of_a_sphere(origin):
    near, far = sphere_ranges(origin, RAYS, np.array([0, 0, 0.05]), 0.008)
    assert [near[0], far[0]] == pytest.approx([0.042, 0.058]) and np.isnan([near[1], far[1]]).all()


def test_rays_from_inside_meet_the_cap():
    cap = Cap(0.020, 0.013)
    assert cap.meet(np.array([0, 0, -0.01]), RAYS[:1]) == pytest.approx(np.array([[0, 0, 0.013]]))
    assert cap.heights(np.array([[0, 0], [cap.rim_radius, 0], [1.0, 0]])) == pytest.approx([0.013, 0, np.nan], nan_ok=True, abs=1e-12)


def test_a_cap_higher_than_its_sphere_is_refused():
    with pytest.raises(BadArgument, match='height'):
        Cap(0.020, 0.041)

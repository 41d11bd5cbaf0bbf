# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel planar_twist (src/common/planar_twist.cpp) against NumPy."""
import numpy as np
import pytest
from tactile_perception._core import planar_twist

FAR = 4.0


def reference(place, velocity):
    """Velocity at the origin, angular velocity and centre by the equations of a rigid motion."""
    zero, one = np.zeros(len(place)), np.ones(len(place))
    rows = np.concatenate([np.stack([one, zero, -place[:, 1]], axis=1), np.stack([zero, one, place[:, 0]], axis=1)])
    x, y, turn = np.linalg.lstsq(rows, velocity.T.ravel(), rcond=None)[0]
    middle, mean = place.mean(axis=0), velocity.mean(axis=0)
    radius = np.sqrt(np.square(place - middle).sum(axis=1).mean())
    far = np.linalg.norm(mean) >= abs(turn) * FAR * radius
    return [x, y], turn, np.full(2, np.nan) if far else np.array([-y, x]) / turn


@pytest.mark.parametrize('seed', range(30))
def test_twists_are_the_references(seed):
    rng = np.random.default_rng(seed)
    place = rng.normal(0, 3, (rng.integers(2, 60), 2)) + rng.normal(0, 5, 2)
    arm = place - rng.normal(0, 5, 2)
    velocity = rng.normal(0, 1) * np.stack([-arm[:, 1], arm[:, 0]], axis=1) + rng.normal(0, 3, 2) + rng.normal(0, 0.1, place.shape)
    for one, other in zip(planar_twist(place, velocity, far=FAR), reference(place, velocity)):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize('place', [np.zeros((0, 2)), np.ones((1, 2)), np.ones((7, 2)), np.full((7, 2), np.nan)])
def test_places_that_tell_nothing_are_unknown(place):
    assert all(np.isnan(part).all() for part in planar_twist(place, np.ones(place.shape), far=FAR))

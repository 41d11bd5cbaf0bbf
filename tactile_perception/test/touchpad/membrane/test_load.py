# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.touchpad.membrane.load import (
    TOUCHED_MEAN, TOUCHED_SPREAD, contact_probability, drop_weak_patches, expectation, log_likelihood_ratio)
from tactile_perception.touchpad.membrane.mesh import GridMesh

MESH = GridMesh(9, 9)


def _patch(rows, columns):
    grid = np.zeros((9, 9))
    grid[rows, columns] = 1
    return grid.ravel()


def test_a_load_of_the_fluids_pressure_speaks_for_touch_and_none_against_it():
    gain = log_likelihood_ratio(np.array([0.0, 0.2, 1.0, 2.5]), 0.06)
    assert gain[0] < -3 and gain[1] > 0 and gain[2] > 100 and gain[3] > 100


def test_what_measurement_cannot_tell_is_no_evidence():
    assert abs(log_likelihood_ratio(np.array([1.0]), 0.06, 100.0)[0]) < 0.01


def test_a_free_dot_expects_no_load_and_a_touched_one_its_own():
    weight, pull = expectation(np.array([0.5, TOUCHED_MEAN]), np.array([0.0, 1.0]), 0.2)
    np.testing.assert_allclose(weight, [25.0, 1 / TOUCHED_SPREAD**2])
    np.testing.assert_allclose(pull, [12.5, 0.0], atol=1e-12)


def test_neighbours_decide_where_the_load_says_nothing():
    around = contact_probability(MESH, np.zeros(81), _patch(slice(2, 7), slice(2, 7)))
    assert around[4 * 9 + 4] > 0.95 and around[10] < 0.05
    assert not contact_probability(MESH, np.full(81, 10.0), np.ones(81))[~MESH.inner].any()


def test_one_dot_however_loud_is_no_contact_and_a_patch_is():
    loud = _patch(3, 3)
    assert not drop_weak_patches(MESH, 1000 * loud, loud).any()
    patch = _patch(slice(3, 5), slice(3, 5))
    np.testing.assert_array_equal(drop_weak_patches(MESH, 7 * patch, patch), patch)
    assert not drop_weak_patches(MESH, 2 * patch, patch).any()
    assert not drop_weak_patches(MESH, np.zeros(81), np.zeros(81)).any()

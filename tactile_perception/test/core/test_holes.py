# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unseen dots in the kernel membrane_loads (src/touchpad/membrane/holes.cpp), interpolated, against NumPy."""
import numpy as np
import pytest
from hole_reference import filled_holes
from tactile_perception import _core


def places(values, known, rows, columns):
    """Places of all dots whose displacements are values where known, of a membrane that is at rest in one place."""
    id, rest = np.flatnonzero(known), np.zeros((rows * columns, 3))
    triangles = _core.membrane_at_rest(rest, rows=rows, columns=columns, stiffness=90.0, area_share=0.8)
    xyz, seen, *_ = _core.membrane_loads(id, values[id], rest, triangles, rest, np.array([0, 0, -0.04]), rows=rows, columns=columns,
                                         rest_pressure=2000.0, settled=np.inf)
    np.testing.assert_array_equal(seen, known)
    return xyz


@pytest.mark.parametrize('seed', range(30))
def test_holes_of_any_form_are_filled_as_by_a_dense_matrix(seed):
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(3, 14, 2).tolist()
    known = rng.random(rows * columns) < rng.choice([0.03, 0.3, 0.7, 0.98])
    values = np.where(known[:, None], rng.standard_normal((rows * columns, 3)), np.nan)
    np.testing.assert_allclose(places(values, known, rows, columns), filled_holes(values, known, rows, columns), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize('some', [True, False])
def test_all_or_nothing_known(some):
    values = np.arange(36.0).reshape(12, 3)
    np.testing.assert_array_equal(places(values, np.full(12, some), 3, 4), values * some)


def test_a_hole_is_filled_as_a_soap_film_and_the_known_dots_stay():
    row, column = np.divmod(np.arange(49), 7)
    plane = np.stack([row * 1.0, 2.0 * column - row, 0.0 * row], axis=1)
    known = ~(((row >= 2) & (row <= 4)) & ((column == 3) | (column == 4)))
    found = places(plane, known, 7, 7)
    np.testing.assert_allclose(found, plane, atol=0.6)
    np.testing.assert_array_equal(found[known], plane[known])

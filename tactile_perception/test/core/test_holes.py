# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception import _core


def reference(values, known, rows, columns):
    """Laplace's equation at all holes at once, by a dense matrix."""
    filled, holes = np.where(known[:, None], values, 0.0), np.flatnonzero(~known)
    if not known.any() or not len(holes):
        return filled
    matrix, right = np.zeros((len(holes),) * 2), np.zeros((len(holes), values.shape[1]))
    for n, k in enumerate(holes):
        for near in range(rows * columns):
            if near != k and abs(near // columns - k // columns) <= 1 and abs(near % columns - k % columns) <= 1:
                matrix[n, n] += 1.0 if known[near] else 0.5
                if known[near]:
                    right[n] += values[near]
                else:
                    matrix[n, np.searchsorted(holes, near)] -= 0.5
    filled[holes] = np.linalg.solve(matrix, right)
    return filled


@pytest.mark.parametrize('seed', range(30))
def test_holes_of_any_form_are_filled_as_by_a_dense_matrix(seed):
    rng = np.random.default_rng(seed)
    rows, columns, count = rng.integers(3, 14, 2).tolist() + [int(rng.integers(1, 4))]
    known = rng.random(rows * columns) < rng.choice([0.03, 0.3, 0.7, 0.98])
    values = np.where(known[:, None], rng.standard_normal((rows * columns, count)), np.nan)
    found = _core.fill_holes(values, known, rows=rows, columns=columns)
    np.testing.assert_allclose(found, reference(values, known, rows, columns), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize('some', [True, False])
def test_all_or_nothing_known(some):
    values = np.arange(24.0).reshape(12, 2)
    np.testing.assert_array_equal(_core.fill_holes(values, np.full(12, some), rows=3, columns=4), values * some)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels assign_least, link_places (src/dots/index/assignment.cpp) and nearest_others (src/dots/index/neighbours.cpp) against SciPy
and plain search."""
import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import assign_least, link_places, nearest_others

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, rows=st.integers(0, 25), more=st.integers(0, 10), whole=st.booleans())
@settings(max_examples=150, deadline=None)
def test_the_sum_of_costs_is_the_least(seed, rows, more, whole):
    cost = np.random.default_rng(seed).normal(0, 2, (rows, rows + more))
    cost = np.round(cost) if whole else cost
    column = assign_least(cost)
    assert len(set(column.tolist())) == rows
    assert cost[np.arange(rows), column].sum() == pytest.approx(cost[scipy.optimize.linear_sum_assignment(cost)].sum(), abs=1e-9)


def test_costs_are_finite_and_no_more_rows_than_columns():
    for wrong in (np.zeros((3, 2)), np.full((2, 3), np.nan), np.full((2, 3), np.inf)):
        with pytest.raises(ValueError, match='^cost: '):
            assign_least(wrong)


@given(seed=SEEDS, places=st.integers(0, 40), dots=st.integers(0, 40), gate=st.floats(0.1, 60))
@settings(max_examples=150, deadline=None)
def test_links_cost_as_little_as_those_of_the_whole_matrix(seed, places, dots, gate):
    rng = np.random.default_rng(seed)
    p, d = rng.uniform(0, 100, (places, 2)), rng.uniform(0, 100, (dots, 2))
    cost = np.minimum(((p[:, None] - d)**2).sum(axis=2), gate**2)
    a, b = link_places(p, d, gate=gate).T
    assert len(set(a.tolist())) == len(a) == len(set(b.tolist()))
    assert (cost[a, b] < gate**2).all() and (np.diff(a) > 0).all()
    expected = (cost[scipy.optimize.linear_sum_assignment(cost)] - gate**2).sum()
    assert (cost[a, b] - gate**2).sum() == pytest.approx(expected, abs=1e-6)


@given(seed=SEEDS, number=st.integers(0, 60), count=st.integers(1, 6), whole=st.booleans())
@settings(max_examples=100, deadline=None)
def test_the_nearest_are_those_of_a_plain_search(seed, number, count, whole):
    rng = np.random.default_rng(seed)
    places = rng.integers(0, 8, (number, 2)).astype(float) if whole else rng.uniform(0, 8, (number, 2))
    away = np.linalg.norm(places[:, None] - places, axis=2)
    away[np.diag_indices(number)] = np.inf
    index, distance = nearest_others(places, count=count)
    expected = np.sort(np.pad(away, ((0, 0), (0, count)), constant_values=np.inf), axis=1)[:, :count]
    np.testing.assert_allclose(distance, expected)
    known = index >= 0
    np.testing.assert_array_equal(known, np.isfinite(expected))
    np.testing.assert_allclose(away[np.nonzero(known)[0], index[known]], distance[known])


@pytest.mark.parametrize('wrong', [0, 1000])
def test_the_number_of_neighbours_is_checked(wrong):
    with pytest.raises(ValueError, match='^count: '):
        nearest_others(np.zeros((3, 2)), count=wrong)


@pytest.mark.parametrize('wrong', [-1.0, np.nan, np.inf])
def test_the_gate_is_checked(wrong):
    with pytest.raises(ValueError, match='^gate: '):
        link_places(np.zeros((3, 2)), np.zeros((3, 2)), gate=wrong)

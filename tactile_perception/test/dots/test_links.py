# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Links between two sets of places against SciPy, nearest places against plain search, and tracks."""
import copy

import numpy as np
import pytest
import scipy
from hypothesis import given, settings, strategies as st
from tactile_perception._core.dots import Linker, link_places, nearest_others
from tactile_perception.errors import BadArgument

SEEDS = st.integers(0, 2**32 - 1)


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
    found = nearest_others(places, count=count)
    index, distance = found.index, found.distance
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


def scattered(count=120, least=20.0, seed=0):
    """Places at random, none nearer than least px to another."""
    rng, places = np.random.default_rng(seed), []
    while len(places) < count:
        p = rng.uniform(0, 450, 2)
        if all(np.hypot(*(p - q)) > least for q in places):
            places.append(p)
    return np.array(places)


def test_numbers_stay_through_a_drag_of_two_spacings():
    uv, linker, rng = scattered(), Linker(), np.random.default_rng(1)
    linker.update(uv, -0.02)
    for step in range(40):
        order = rng.permutation(len(uv))
        shift = 45.0 * np.sin(np.pi * step / 39) * np.exp(-((uv - 225) ** 2).sum(axis=1, keepdims=True) / (2 * 90**2))
        number = linker.update((uv + shift * [1, 0] + rng.normal(0, 0.1, uv.shape))[order], step / 60)
        np.testing.assert_array_equal(number, order)


def test_lost_dots_come_back_under_their_number_and_none_is_used_twice():
    uv, linker = scattered(30), Linker(keep_s=0.5)
    linker.update(uv, 0.0)
    assert linker.update(uv[1:], 0.1).tolist() == list(range(1, 30))
    assert linker.update(uv, 0.2)[0] == 0
    for step in range(10):
        linker.update(uv[1:], 0.3 + 0.1 * step)
    for step in range(3):
        number = linker.update(uv, 2.0 + 0.1 * step)
    assert number[0] >= 30


def test_a_false_dot_of_one_frame_is_never_handed_out():
    uv, linker = scattered(30), Linker()
    linker.update(uv, 0.0)
    assert linker.update(np.vstack([uv, [[600.0, 600.0]]]), 0.1)[-1] == -1
    assert sorted(linker.update(np.vstack([uv, [[600.0, 600.0]]]), 0.2)) == [-1, *range(30)], 'it begins anew'


def test_no_dots():
    linker = Linker()
    assert len(linker.update(np.zeros((0, 2)), 0.0)) == 0
    assert linker.update(scattered(5), 1.0).tolist() == [0, 1, 2, 3, 4]
    assert len(linker.update(np.zeros((0, 2)), 1.1)) == 0


def test_wrong_parameters():
    with pytest.raises(BadArgument, match='gate > 0'):
        Linker(gate=0)


def test_a_copy_goes_on_alone():
    uv, linker = scattered(30), Linker()
    linker.update(uv, 0.0)
    other = copy.deepcopy(linker)
    assert other.update(np.vstack([uv + 3, uv[:1] + 60]), 0.1)[:30].tolist() == linker.update(uv + 3, 0.1).tolist() == list(range(30))
    linker.reset()
    assert linker.update(uv, 1.0).tolist() == list(range(30, 60)), 'ids are not used again'

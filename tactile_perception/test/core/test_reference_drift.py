# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of src/dots/reference/reference_drift.cpp against NumPy."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import deviation_from_drift, follow_drift, have_stayed, reference_places, rest_moved

SEEDS = st.integers(0, 2**32 - 1)


def residuals(places, motions, kept):
    """Squared residuals (N,) of all from the affine map fitted to those kept."""
    basis = np.column_stack([np.ones(len(places)), places])
    return ((motions - basis @ np.linalg.lstsq(basis[kept], motions[kept], rcond=None)[0])**2).sum(axis=1)


def deviation(places, motions, sigma):
    """(moved, size) in NumPy."""
    known = np.isfinite(motions).all(axis=1)
    places, motions, sigma = places[known], motions[known], sigma[known]
    count = len(places)
    if not count:
        return False, 0.0
    shared = np.sort(np.linalg.norm(motions, axis=1))[count // 2]
    if count < 8:
        return shared > 0.5, shared
    square = residuals(places, motions, np.ones(count, bool))
    square = residuals(places, motions, square <= np.sort(square)[int(0.8 * count)])
    leaving = np.count_nonzero(np.sqrt(square) > np.maximum(5 * sigma, 0.1))
    return leaving > 0.01 * count or shared > 0.5, max(np.sqrt(np.sort(square)[int(0.99 * (count - 1))]), shared)


@given(seed=SEEDS, count=st.integers(0, 200), drift=st.floats(0, 0.02), press=st.floats(0, 3), unknown=st.floats(0, 0.5))
@settings(max_examples=100, deadline=None)
def test_deviations_are_those_of_two_affine_fits(seed, count, drift, press, unknown):
    rng = np.random.default_rng(seed)
    places = rng.uniform(0, 300, (count, 2))
    motions = drift * (places - 100) @ rng.normal(0, 1, (2, 2)) + rng.normal(0, 0.02, places.shape)
    motions += press * np.exp(-((places - 150)**2).sum(axis=1, keepdims=True) / 30**2)
    motions[rng.random(count) < unknown] = np.nan
    sigma = rng.uniform(0.01, 0.05, count)
    moved, size = deviation_from_drift(places, motions, sigma)
    expected = deviation(places, motions, sigma)
    assert moved == expected[0]
    assert size == pytest.approx(expected[1], rel=1e-6, abs=1e-6)


def test_dots_on_one_line_and_dots_without_a_standard_deviation():
    places, motions = np.arange(40.0).reshape(20, 2), np.zeros((20, 2))
    assert deviation_from_drift(places, motions, np.full(20, 0.02)) == (False, 0.0)
    motions[::3] = 0.4
    assert deviation_from_drift(places, motions, np.full(20, 0.02))[0]
    assert not deviation_from_drift(places, motions, np.full(20, np.nan))[0]


@given(seed=SEEDS, known=st.integers(0, 30), count=st.integers(0, 30), apart=st.sampled_from([1, 10**9]))
@settings(max_examples=60, deadline=None)
def test_places_are_those_of_the_ids(seed, known, count, apart):
    rng = np.random.default_rng(seed)
    known_id, places = np.sort(rng.permutation(50)[:known]), rng.normal(0, 1, (known, 2))
    id = rng.permutation(50)[:count]
    expected = np.full((50, 2), np.nan)
    expected[known_id] = places
    np.testing.assert_array_equal(reference_places(apart * id - 7, apart * known_id - 7, places), expected[id])


@given(seed=SEEDS, frames=st.integers(1, 5), slow=st.floats(0, 1))
@settings(max_examples=60, deadline=None)
def test_known_places_follow_by_mean_then_slowly(seed, frames, slow):
    rng = np.random.default_rng(seed)
    known_id, rest, counts = np.arange(0, 40, 2), rng.normal(0, 1, (20, 2)), rng.integers(0, 8, 20)
    id = rng.permutation(40)[:25]
    places = rng.normal(0, 1, (25, 2))
    moved, increased = follow_drift(id, places, known_id, rest, counts, frames=frames, slow=slow)
    for k in range(20):
        seen = np.flatnonzero(id == known_id[k])
        gain = 1 / (counts[k] + 1) if counts[k] < frames else slow
        np.testing.assert_allclose(moved[k], rest[k] + gain * (places[seen[0]] - rest[k]) if len(seen) else rest[k], atol=1e-12)
        assert increased[k] == counts[k] + len(seen)


@pytest.mark.parametrize('wrong', [{'frames': 0}, {'slow': 1.5}, {'slow': np.nan}])
def test_numbers_of_follow_drift_are_checked(wrong):
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        follow_drift(np.arange(3), np.zeros((3, 2)), np.arange(3), np.zeros((3, 2)), np.arange(3), **({'frames': 3, 'slow': 0.1} | wrong))


def test_known_ids_must_rise():
    with pytest.raises(ValueError, match='^known_id: '):
        reference_places(np.arange(3), np.array([2, 1, 0]), np.zeros((3, 2)))


@given(seed=SEEDS, then=st.integers(0, 120), now=st.integers(0, 120), moved=st.sampled_from([0.01, 0.09, 0.11, 0.5]),
       moving=st.sampled_from([0.0, 0.005, 0.03, 1.0]), sigma=st.sampled_from([0.001, 0.05]), apart=st.sampled_from([1, 10**9]))
@settings(max_examples=150, deadline=None)
def test_dots_stayed_if_nearly_all_are_within_their_noise(seed, then, now, moved, moving, sigma, apart):
    rng = np.random.default_rng(seed)
    uv = rng.uniform(0, 300, (130, 2))
    id, before = rng.permutation(130)[:now], rng.permutation(130)[:then]
    after = uv + np.where(rng.random((130, 1)) < moving, [moved, 0.0], 0.0)
    both = np.intersect1d(id, before)
    far = np.sort(np.linalg.norm(after[both] - uv[both], axis=1))
    expected = len(both) > 0 and len(both) >= 0.9 * max(now, then) and far[int(0.99 * (len(both) - 1))] < max(0.1, 7 * sigma)
    assert have_stayed(apart * id, after[id], np.full(now, sigma), apart * before, uv[before]) == expected


@given(seed=SEEDS, count=st.integers(0, 12), moved=st.sampled_from([0.0, 0.09, 0.11]), unknown=st.sampled_from([0.0, 0.1]))
@settings(max_examples=100, deadline=None)
def test_a_rest_moves_with_any_dot_that_is_finite(seed, count, moved, unknown):
    rng = np.random.default_rng(seed)
    known, motions = rng.uniform(0, 300, (20, 2)), rng.normal(0, 9, (count, 2))
    id = rng.permutation(20)[:count]
    places = known[id] + motions + moved * rng.uniform(-1, 1, (count, 2)) / rng.uniform(0.9, 5)
    known[rng.random((20, 2)) < unknown / 4], motions[rng.random((count, 2)) < unknown] = np.nan, np.nan
    rest = places - motions
    finite = np.isfinite(rest).all(axis=1)
    expected = not (np.abs(rest - known[id]) <= 0.1)[finite].all()
    assert rest_moved(id, places, motions, known, limit=0.1) == expected

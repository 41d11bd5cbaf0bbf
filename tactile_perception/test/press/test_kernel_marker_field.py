# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels of src/press/marker_field.cpp against NumPy."""
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import follow_markers, marker_field

SEEDS, SHARES = st.integers(0, 2**32 - 1), st.floats(0, 0.5)
MOVED, STILL, MOST = 0.3, 0.25, 5


def some_tracks(seed, markers, unknown):
    """id, uv, duv, area, sigma of some of the markers; a share of the displacements is not known."""
    rng = np.random.default_rng(seed)
    id = rng.permutation(markers)[:rng.integers(0, markers + 1)]
    duv = rng.normal(0, 0.3, (len(id), 2))
    duv[rng.random(len(id)) < unknown, rng.integers(0, 2)] = np.nan
    return id, rng.uniform(0, 300, (len(id), 2)), duv, rng.uniform(50, 60, len(id)), rng.uniform(0.01, 0.1, len(id))


def followed(id, uv, duv, area, known_uv, known_area, frames):
    known_uv, known_area, frames = known_uv.copy(), known_area.copy(), frames.copy()
    known = np.isfinite(duv).all(axis=1)
    id, uv, duv, area = id[known], uv[known], duv[known], area[known]
    frames[id[~(np.abs(uv - duv - known_uv[id]) <= MOVED).all(axis=1)]] = 0
    known_uv[id] = uv - duv
    still = (np.abs(duv) <= STILL).all(axis=1)
    id, area = id[still], area[still]
    frames[id] = np.minimum(frames[id] + 1, MOST)
    known_area[id] = np.where(frames[id] == 1, area, known_area[id] + (area - known_area[id]) / frames[id])
    return known_uv, known_area, frames


@given(seed=SEEDS, markers=st.integers(1, 40), unknown=SHARES)
@settings(max_examples=100, deadline=None)
def test_untouched_markers_follow_those_that_are_still(seed, markers, unknown):
    rng = np.random.default_rng(seed + 1)
    id, uv, duv, area, _ = some_tracks(seed, markers, unknown)
    known_uv = np.full((markers, 2), np.nan)
    known_uv[id] = uv - duv + rng.normal(0, 0.2, duv.shape)
    frames = rng.integers(0, MOST + 1, markers).astype(float)
    known_area = np.where(frames > 0, rng.uniform(50, 60, markers), np.nan)
    found = follow_markers(id, uv, duv, area, known_uv, known_area, frames, moved=MOVED, still=STILL, most_frames=MOST)
    for mine, expected in zip(found, followed(id, uv, duv, area, known_uv, known_area, frames)):
        np.testing.assert_array_equal(mine, expected)


@given(seed=SEEDS, markers=st.integers(1, 40), unknown=SHARES)
@settings(max_examples=100, deadline=None)
def test_a_field_has_each_marker_at_its_id(seed, markers, unknown):
    rng = np.random.default_rng(seed + 1)
    id, uv, duv, area, sigma = some_tracks(seed, markers, unknown)
    now, rest, eye = (rng.normal(size=(len(id), 3)) for _ in range(3))
    known_area = np.where(rng.random(markers) < unknown, rng.choice([np.nan, 0.0]), 55.0)
    eye = eye[:1] if len(id) and seed % 2 else eye
    found = marker_field(id, uv, duv, area, sigma, np.concatenate([now, rest]), eye, known_area, metres_per_px=1e-4)
    with np.errstate(all='ignore'):
        growth = np.log(area / known_area[id] * (now[:, 2] / rest[:, 2]))
    growth[~np.isfinite(growth)] = np.nan
    expected = rest[:, :2], now[:, :2] - rest[:, :2], growth, np.broadcast_to(eye, now.shape), sigma * 1e-4, uv, duv, area
    for mine, values in zip(found, expected):
        whole = np.full((markers, *values.shape[1:]), np.nan)
        whole[id] = values
        np.testing.assert_allclose(mine, whole, rtol=1e-12)


def test_markers_of_another_pattern_are_left_out():
    known = np.zeros((2, 2)), np.full(2, 50.0), np.ones(2)
    found = follow_markers(np.array([-1, 2]), np.ones((2, 2)), np.zeros((2, 2)), np.full(2, 60.0), *known, moved=MOVED, still=STILL,
                           most_frames=MOST)
    for mine, before in zip(found, known):
        np.testing.assert_array_equal(mine, before)

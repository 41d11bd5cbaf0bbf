# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel water_ranges (src/touchpad/optics/water_ranges.cpp) against Newton steps, normals and Laplacian taken one dot at a time."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import path_lengths, water_ranges

PATH = np.array([-0.005, -0.038, 0.018, 0.2, 0.0, 0.0, -0.04])  # window, lamps' height and radius, ambient, camera
CENTRE, PITCH = PATH[4:], 1e-3


def flat_pad(rows, columns, height=0.05):
    """Rays (N, 3) and rest ranges (N,) of a grid in a plane over the camera, and its normals."""
    y, x = np.meshgrid(PITCH * (np.arange(rows) - rows // 2), PITCH * (np.arange(columns) - columns // 2), indexing='ij')
    away = np.stack([x.ravel(), y.ravel(), np.full(x.size, height)], axis=1)
    ranges = np.linalg.norm(away, axis=1)
    return away / ranges[:, None], ranges, np.broadcast_to([0.0, 0.0, 1.0], away.shape).copy()


def solve(lengths, rays, ranges, normals, rows, columns, share=0.45, id=None):
    """water_ranges with ids in order."""
    id = np.arange(len(lengths)) if id is None else id
    return water_ranges(PATH, lengths, rays=rays, id=id, rest_ranges=ranges, rest_normals=normals, rows=rows, columns=columns,
                        ring_share=share)


def newton(lengths, rays, start, normals):
    """One step for each ray."""
    here, slope, _ = path_lengths(PATH, CENTRE + start[:, None] * rays, normals, rays)
    return start + (lengths - here) / slope, slope


def reference(lengths, rays, rest, normals, id, rows, columns, share):
    """Ranges and slopes as the kernel should have them."""
    first, _ = newton(lengths, rays, rest, normals)
    change, at = np.full((rows, columns), np.nan), np.full((rows, columns, 3), np.nan)
    change.ravel()[id] = first - rest
    even = np.full_like(change, np.nan)
    weights = np.outer([1, 2, 1], [1, 2, 1])
    for r in range(rows):
        for c in range(columns):
            near = [(weights[i + 1, j + 1], change[r + i, c + j]) for i in (-1, 0, 1) for j in (-1, 0, 1)
                    if 0 <= r + i < rows and 0 <= c + j < columns and np.isfinite(change[r + i, c + j])]
            even[r, c] = sum(w * v for w, v in near) / sum(w for w, _ in near) if near else np.nan
    at.reshape(-1, 3)[id] = CENTRE + (rest + np.nan_to_num(even.ravel()[id]))[:, None] * rays
    facing, bend = normals.copy(), np.zeros(len(id))
    for k, (r, c) in enumerate(zip(*np.divmod(id, columns))):
        if not (0 < r < rows - 1 and 0 < c < columns - 1):
            continue
        normal = np.cross(at[r, c + 1] - at[r, c - 1], at[r + 1, c] - at[r - 1, c])
        if np.isfinite(normal).all():
            facing[k] = normal / np.linalg.norm(normal) * np.sign(normal[2])
        bend[k] = np.nan_to_num(even[r - 1, c] + even[r + 1, c] + even[r, c - 1] + even[r, c + 1] - 4 * even[r, c])
    second, slope = newton(lengths, rays, first, facing)
    return second - bend * share**2 / 4, slope


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(3, 9), columns=st.integers(3, 9), share=st.floats(0, 1))
@settings(max_examples=40, deadline=None)
def test_ranges_are_those_of_the_steps_one_by_one(seed, rows, columns, share):
    rng = np.random.default_rng(seed)
    rays, ranges, normals = flat_pad(rows, columns)
    lengths = path_lengths(PATH, CENTRE + ranges[:, None] * rays, normals, rays)[0] + rng.normal(0, 3e-4, len(ranges))
    lengths[rng.random(len(lengths)) < 0.1] = np.nan
    seen = np.flatnonzero(rng.random(len(lengths)) < 0.9)
    found = solve(lengths[seen], rays[seen], ranges[seen], normals[seen], rows, columns, share, seen)
    expected = reference(lengths[seen], rays[seen], ranges[seen], normals[seen], seen, rows, columns, share)
    for a, b in zip(found, expected):
        np.testing.assert_allclose(a, b, rtol=1e-9)


def test_a_tilted_plane_is_found_from_its_lengths():
    rays, ranges, normals = flat_pad(9, 9)
    tilted = 0.05 / (rays[:, 2] - 0.1 * rays[:, 0])  # the plane z = 0.05 + 0.1 x over the camera
    facing = np.broadcast_to(np.array([-0.1, 0, 1]) / np.hypot(0.1, 1), rays.shape).copy()
    lengths, _, _ = path_lengths(PATH, CENTRE + tilted[:, None] * rays, facing, rays)
    inner = np.zeros((9, 9), bool)
    inner[2:-2, 2:-2] = True
    error = (solve(lengths, rays, ranges, normals, 9, 9)[0] - tilted)[inner.ravel()]
    assert np.abs(error).max() < 5e-6
    assert np.abs(tilted - ranges).max() > 3e-4


def test_without_a_grid_the_normals_are_those_at_rest():
    rays, ranges, normals = flat_pad(5, 5)
    lengths = path_lengths(PATH, CENTRE + ranges[:, None] * rays, normals, rays)[0] + 2e-4
    first, _ = newton(lengths, rays, ranges, normals)
    found = solve(lengths, rays, ranges, normals, 0, 0, id=np.arange(25) + 10_000)
    np.testing.assert_allclose(found[0], newton(lengths, rays, first, normals)[0], rtol=1e-12)


@pytest.mark.parametrize('wrong', [{'id': np.full(25, 25)}, {'id': np.full(25, -1)}, {'rows': -1}, {'columns': 5000},
                                   {'ring_share': np.nan}, {'rays': np.zeros((24, 3))}])
def test_wrong_arguments_are_refused_by_name(wrong):
    rays, ranges, normals = flat_pad(5, 5)
    given = {'rays': rays, 'id': np.arange(25), 'rest_ranges': ranges, 'rest_normals': normals, 'rows': 5, 'columns': 5,
             'ring_share': 0.45} | wrong
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        water_ranges(PATH, ranges, **given)

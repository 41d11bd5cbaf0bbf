# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Elastic forces against the slope of the energy worked out triangle by triangle, and areas against a plane's."""
import pickle

import numpy as np
import pytest
from tactile_perception.touchpad.membrane.cells import MembraneCells
from tactile_perception.touchpad.membrane.mesh import GridMesh

ROWS, COLUMNS, STIFFNESS = 5, 6, 70.0


def _places(seed, height=0.3e-3):
    row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
    return np.stack([column * 1.3e-3, row * 1.2e-3, np.zeros(len(row))]) + np.random.default_rng(seed).normal(size=(3, len(row))) * height


def _areas(mesh, x):
    corner = x[:, mesh.triangles]
    return np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0], axis=0), axis=0) / 2


def _springs():
    """One weight for each edge that exists: right, down, down and right, and from the dot on the right down and left."""
    springs = np.random.default_rng(1).uniform(20, 60, (4, ROWS, COLUMNS))
    springs[0, :, -1], springs[1, -1], springs[2, -1], springs[2, :, -1], springs[3, -1], springs[3, :, -1] = 0, 0, 0, 0, 0, 0
    return springs.reshape(4, -1)


def _energy(mesh, springs, rest_area, x):
    """Springs' and that of area, of which each triangle counts half, its force per area STIFFNESS / 2 (A0 / A)^3."""
    ends = [(0, 1), (0, COLUMNS), (0, COLUMNS + 1), (1, COLUMNS)]
    stretched = sum(springs[k, i] / 2 * np.sum((x[:, i + end] - x[:, i + start])**2)
                    for k, (start, end) in enumerate(ends) for i in np.flatnonzero(springs[k]))
    return stretched + (STIFFNESS / 4 * rest_area**3 / _areas(mesh, x)**2).sum()


def test_the_force_is_the_slope_of_the_energy():
    mesh, springs, rest = GridMesh(ROWS, COLUMNS), _springs(), _places(0, 0.05e-3)
    cells, x, rest_area = MembraneCells(mesh, springs, rest, STIFFNESS), _places(2), _areas(mesh, rest)
    force = cells.evaluate(x)[0]
    slope = np.zeros_like(x)
    for axis, k in np.ndindex(*x.shape):
        step = np.zeros_like(x)
        step[axis, k] = 1e-8
        slope[axis, k] = (_energy(mesh, springs, rest_area, x + step) - _energy(mesh, springs, rest_area, x - step)) / 2e-8
    np.testing.assert_allclose(force, -slope, atol=1e-6 * np.abs(slope).max())


def test_the_shares_of_a_plane_add_up_to_its_area():
    mesh, flat = GridMesh(ROWS, COLUMNS), _places(0, 0.0)
    share = MembraneCells(mesh, _springs(), flat, STIFFNESS).evaluate(flat)[1]
    assert share.sum(1) == pytest.approx([0, 0, 4 * 5 * 1.3e-3 * 1.2e-3], abs=1e-15)
    np.testing.assert_allclose(share[2, mesh.inner], 1.3e-3 * 1.2e-3)


def test_what_was_returned_stays_as_it_was():
    mesh = GridMesh(ROWS, COLUMNS)
    cells = MembraneCells(mesh, _springs(), _places(0, 0.05e-3), STIFFNESS)
    first = cells.evaluate(_places(2))
    kept = [part.copy() for part in first]
    cells.evaluate(_places(3))
    np.testing.assert_array_equal(first, kept)


def test_a_stored_one_evaluates_the_same_to_the_last_bit():
    mesh = GridMesh(ROWS, COLUMNS)
    cells = MembraneCells(mesh, _springs(), _places(0), STIFFNESS)
    restored = pickle.loads(pickle.dumps(cells))
    for seed in (2, 3):
        for one, other in zip(cells.evaluate(_places(seed)), restored.evaluate(_places(seed))):
            assert np.array_equal(one, other)

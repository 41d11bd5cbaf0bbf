# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unseen dots, placed by the balance around them, against dense normal equations in NumPy."""
import numpy as np
import pytest
from tactile_perception import _core
from tactile_perception.touchpad.contact import DotLoads
from tactile_perception.touchpad.membrane import MembraneMaterial, Membrane

ORIGIN, EXPECTED, SPREAD = np.array([0.0, 0.0, -0.04]), (0.0, 1.3), (0.4, 0.8)


def reference(membrane, material, origin, state):
    mesh, holes = membrane.mesh, np.flatnonzero(~state.seen)
    rays = state.xyz - origin
    rays /= np.sqrt(np.square(rays).sum(axis=1))[:, None]
    slopes = membrane.forces.slopes(state.xyz, rays, material.rest_pressure)
    around = np.unique(mesh.stencil[holes])
    around = around[mesh.inner[around]]
    row, slot = np.nonzero(~state.seen[mesh.stencil[around]])
    hole = np.searchsorted(holes, mesh.stencil[around[row], slot])
    matrix = np.zeros((len(around), len(holes)))
    matrix[row, hole] = slopes[around[row], slot]
    held = (state.load[around] > .5).astype(int)
    weight = np.take(SPREAD, held)**-2.0
    normal = matrix.T @ (weight[:, None] * matrix) + np.eye(len(holes)) / 1e-3**2
    change = -np.linalg.solve(normal, matrix.T @ (weight * (state.load[around] - np.take(EXPECTED, held))))
    xyz = state.xyz.copy()
    xyz[holes] += np.clip(change, -4e-4, 4e-4)[:, None] * rays[holes]
    return xyz


@pytest.mark.parametrize('share', [0.02, 0.3, 0.9, 1.0])
@pytest.mark.parametrize('rows, columns', [(3, 3), (9, 14), (14, 9)])
def test_dots_settle_where_dense_equations_say(rows, columns, share):
    rng, material = np.random.default_rng(rows), MembraneMaterial()
    row, column = np.divmod(np.arange(rows * columns), columns)
    x, y = 1.3e-3 * (column - columns / 2), 1.3e-3 * (row - rows / 2)
    rest = np.column_stack([x, y, np.sqrt(0.02**2 - x**2 - y**2) - 0.007])
    membrane = Membrane(rest, rows, columns, material)
    xyz = rest - [0, 0, 1e-3] * np.exp(-(x**2 + y**2) / 9e-6)[:, None] + rng.normal(size=rest.shape) * 2e-5
    ids = np.flatnonzero(rng.random(len(rest)) >= share)
    state, settled = (DotLoads(*_core.membrane_loads(
        ids, xyz[ids], rest, membrane.forces.triangles, membrane.forces.rest_residual, ORIGIN, rows=rows, columns=columns,
        rest_pressure=material.rest_pressure, settled=most)) for most in (np.inf, -1.0))
    np.testing.assert_allclose(settled.xyz, reference(membrane, material, ORIGIN, state), atol=1e-10)
    np.testing.assert_allclose(settled.xyz[ids], xyz[ids], atol=1e-15)

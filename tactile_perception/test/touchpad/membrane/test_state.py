# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.spherical_cap import Cap
from tactile_perception.touchpad.membrane.forces import MembraneForces, MembraneMaterial
from tactile_perception.touchpad.membrane.mesh import GridMesh
from tactile_perception.touchpad.membrane.state import MembraneState

SIDE, MIDDLE = 9, 40


def _state(dent=0.0):
    y, x = (part.ravel() for part in np.meshgrid(*2 * [np.arange(-4, 5) * 1.3e-3], indexing='ij'))
    rest = np.column_stack([x, y, Cap().heights(np.column_stack([x, y]))])
    forces = MembraneForces(GridMesh(SIDE, SIDE), rest, MembraneMaterial())
    places = rest.T.copy()
    places[2, MIDDLE] -= dent
    return MembraneState(forces, places, np.zeros(81), np.zeros(81), 2000.0, np.ones(81, bool))


def test_nothing_at_rest():
    state = _state()
    np.testing.assert_allclose(state.load, 0, atol=1e-9)
    np.testing.assert_allclose(state.force, 0, atol=1e-12)


def test_a_dot_pushed_in_carries_a_load_and_its_force_goes_inwards():
    state = _state(dent=0.2e-3)
    assert state.load[MIDDLE] == state.load.max() > 1
    force, area = state.force, state.xyz[1, 0] - state.xyz[0, 0]
    assert force[MIDDLE, 2] == pytest.approx(-state.load[MIDDLE] * 2000 * area**2, rel=0.1)
    assert not force[~state.forces.mesh.inner].any() and force.shape == state.xyz.shape == (81, 3)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The layer's Green's function against finite elements, and where it is known in closed form."""
import numpy as np
import pytest
from tactile_driver.simulation.gel.elements import Material, Response
from tactile_perception.errors import BadArgument
from tactile_perception.gel.layer import Layer

RADIUS = 0.3e-3


@pytest.mark.parametrize(('poisson', 'depth'), [(0.48, 0.4e-3), (0.3, 0.0), (0.495, 1e-3)])
def test_displacements_are_those_of_finite_elements(poisson, depth):
    thickness, young = 4e-3, 1e5
    angle = np.array([0.4, 1.3, 2.0, 4.0, 5.5])
    points = np.array([0.8, 1.5, 3.0, 5.0, 8.0])[:, None] * 1e-3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    truth = Response(Material(thickness, depth, young, poisson), RADIUS).matrix(points, np.zeros((1, 2)), 'dots') * [1, 1, -1]
    loads = Layer(thickness, poisson, depth).loads(RADIUS / 2)  # of the same second moment as an even disc
    found = loads.matrix(points, np.zeros((1, 2))) * 2 * (1 + poisson) / young
    np.testing.assert_allclose(found, truth, atol=0.01 * np.abs(truth).max())


def test_a_wide_shear_moves_the_layer_as_a_block():
    layer = Layer(2e-3, 0.49, 0.5e-3)
    wave = layer.waves(np.array([1.0]))  # 6 m long
    np.testing.assert_allclose([wave['along'][0], wave['across'][0]], 1.5e-3, rtol=1e-4)  # height of the dots over the shear modulus
    assert abs(wave['pressed_up'][0]) < 2e-3 * 0.03, 'it can hardly be compressed'


@pytest.mark.parametrize('values', [(0.0, 0.4, 0.0), (1e-3, 0.6, 0.0), (1e-3, 0.4, 1e-3), (np.nan, 0.4, 0.0), (1e-3, 0.4, -1e-4)])
def test_what_is_no_layer_is_refused(values):
    with pytest.raises(BadArgument, match='gel.thickness'):
        Layer(*values)

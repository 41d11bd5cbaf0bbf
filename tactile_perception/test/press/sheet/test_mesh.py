# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.press.sheet.mesh import SheetMesh, basis, locate, may_be_pressed, spread, uniform

HALF, SCALE = np.array([0.030, 0.0225]), 8e-3


@pytest.mark.parametrize('pressed', [(0.0, 0.0), (0.023, -0.016), (-0.02, 0.003)])
def test_locate_undoes_spread(pressed):
    xi = np.linspace(-1, 1, 41)
    place = np.stack([spread(xi, pressed[axis], HALF[axis], SCALE)[0] for axis in (0, 1)])
    assert place[:, [0, -1]] == pytest.approx(np.stack([-HALF, HALF], axis=1))
    assert locate(place, pressed, HALF, SCALE)[0] == pytest.approx(np.stack([xi, xi]), abs=1e-9)


def test_spread_tells_its_derivatives():
    xi, h = np.linspace(-0.95, 0.95, 20), 1e-6
    _, first, second = spread(xi, 0.01, 0.03, SCALE)
    (up, first_up, _), (down, first_down, _) = (spread(xi + step, 0.01, 0.03, SCALE) for step in (h, -h))
    assert first == pytest.approx((up - down) / (2 * h), rel=1e-6) and second == pytest.approx((first_up - first_down) / (2 * h), abs=1e-6)


def test_too_near_to_the_clamp_is_refused():
    with pytest.raises(BadArgument, match='clamp'):
        locate(np.zeros((2, 1)), (0.026, 0.0), HALF, SCALE)


def test_splines_add_up_to_one_and_tell_their_derivatives():
    xi, h = np.linspace(-0.999, 0.999, 50), 1e-6
    first, values = basis(xi, 8)
    assert values[:, 0].sum(1) == pytest.approx(np.ones(50)) and np.abs(values[:, 1:].sum(2)).max() < 1e-9
    field = np.random.default_rng(0).normal(size=10)

    def at(x, order):
        first, values = basis(x, 8)
        return np.sum(values[:, order] * field[first[:, None] + np.arange(3)], axis=1)
    assert at(xi, 1) == pytest.approx((at(xi + h, 0) - at(xi - h, 0)) / (2 * h), abs=1e-5)
    assert at(xi, 2) == pytest.approx((at(xi + h, 1) - at(xi - h, 1)) / (2 * h), abs=1e-4)


def test_presses_just_far_enough_from_the_clamp_count():
    """0.0225 - 0.0165 is a little less than 0.006 in floating point."""
    places = np.array([(0.024, 0.0165), (0.0, -0.0166), (-0.0241, 0.0), (np.nan, np.nan)])
    assert may_be_pressed(places, np.array([0.030, 0.0225]), 0.008).tolist() == [True, False, False, False]
    locate(np.zeros((2, 1)), places[0], np.array([0.030, 0.0225]), 0.008)


def test_the_mesh_integrates_over_the_sheet():
    mesh = SheetMesh((0.01, -0.005), HALF, SCALE, 5)
    assert mesh.weight.sum() == pytest.approx(4 * HALF.prod(), rel=1e-9)
    assert np.sum(mesh.weight * mesh.rest[..., 0] ** 2) == pytest.approx(4 * HALF[1] * HALF[0] ** 3 / 3, rel=2e-3)


def test_uniform_splines_show_the_same_field():
    n, xi = 4, np.linspace(-1, 0.9999, 30)
    open_ends = np.zeros((10, 10, 1))
    open_ends[1:-1, 1:-1] = np.random.default_rng(1).normal(size=(8, 8, 1))
    first, values = basis(xi, 2 * n)
    expected = np.einsum('ki,kj,kij->k', values[:, 0], values[:, 0], open_ends[(first[:, None] + np.arange(3))[:, :, None],
                                                                              (first[:, None] + np.arange(3))[:, None, :], 0])
    f = (xi + 1) * n - first
    weight = np.stack([(1 - f)**2 / 2, 0.5 + f - f * f, f * f / 2], axis=1)
    near = uniform(open_ends)[(first[:, None] + np.arange(3))[:, :, None], (first[:, None] + np.arange(3))[:, None, :], 0]
    assert np.einsum('ki,kj,kij->k', weight, weight, near) == pytest.approx(expected, abs=1e-12)

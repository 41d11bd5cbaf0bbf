# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The membrane: its forces against its energy; its solution with noise, presses, gaps and outliers; and the loads."""
import copy

import numpy as np
import pytest

from tactile_perception.common.geometry import Cap
from tactile_perception.core.errors import BadArgument
from tactile_perception.touchpad.membrane import Membrane, MembraneMaterial

ROWS, COLUMNS, STIFFNESS, SHARE, PRESSURE = 9, 8, 90.0, 0.8, 2000.0
SIZE = ROWS * COLUMNS
ORIGIN = np.array([0.0, 0.0, -0.04])
ROW, COLUMN = np.divmod(np.arange(SIZE), COLUMNS)
CAP = Cap()
SPREAD = 30e-6


def test_an_inflated_sphere_is_in_balance_at_the_pressure_of_a_neo_hookean_balloon():
    rng, angle, radius = np.random.default_rng(1), np.linspace(-0.75, 0.75, 23), 0.020
    y, x = np.meshgrid(np.tan(angle), np.tan(angle), indexing='ij')
    points = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3) + rng.normal(size=(529, 3)) * [0.004, 0.004, 0]
    sphere = radius * points / np.linalg.norm(points, axis=1, keepdims=True)
    membrane, stretch = Membrane(sphere, 23, 23, ORIGIN, MembraneMaterial(90.0, 2000.0, radius)).core, 1.08
    pressure = 2 * 90.0 * (1 - (1 - 20.0 / 90.0) / stretch**6) / (stretch * radius)
    elastic, share = membrane.forces(stretch * sphere)
    left = elastic + pressure * (share - membrane.residual)
    load = (np.linalg.norm(left, axis=1) / (pressure * np.linalg.norm(share, axis=1))).reshape(23, 23)[1:-1, 1:-1]
    assert load.max() < 0.02 and pressure > 4000


def test_impossible_materials_are_refused():
    rest = _rest()[0]
    with pytest.raises(BadArgument, match='shear_stiffness'):
        MembraneMaterial(shear_stiffness=15.0, rest_pressure=2000.0, rest_curvature_radius=0.02)
    MembraneMaterial(26.92788647100231, 2692.788647100231, 0.02)  # p R / 2 equals the stiffness except for the last digit
    with pytest.raises(BadArgument, match='rows and columns'):
        Membrane(rest, 100, 100, ORIGIN)
    rest[::2], rest[1::4] = np.nan, np.nan
    with pytest.raises(BadArgument, match='reference'):
        Membrane(rest, 15, 17, ORIGIN)


def _rest(rows=15, columns=17):
    y, x = np.meshgrid(np.linspace(-0.2, 0.2, rows), np.linspace(-0.22, 0.22, columns), indexing='ij')
    rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return CAP.meet(ORIGIN, rays), rays


@pytest.fixture
def still():
    """A membrane of 15 x 17 dots, the rays to them, and their ranges at rest."""
    rest, rays = _rest()
    return Membrane(rest, 15, 17, ORIGIN), rays, np.linalg.norm(rest - ORIGIN, axis=1)


def solve(membrane, rays, ranges, ids=None, sigma=SPREAD):
    ids = np.arange(len(ranges)) if ids is None else ids
    return membrane.solve(rays, ranges, np.full(len(ranges), sigma), ids)


def loads(membrane, state):
    return membrane.core.loads(np.arange(len(state.xyz)), state.xyz).load


def test_missing_reference_positions_are_interpolated():
    rest = _rest()[0]
    holed = rest.copy()
    holed[[30, 31, 100]] = np.nan
    np.testing.assert_allclose(Membrane(holed, 15, 17, ORIGIN).core.rest, rest, atol=5e-5)


def test_an_untouched_membrane_smooths_the_ranges_and_carries_no_load(still):
    membrane, rays, ranges = still
    rng, inner = np.random.default_rng(0), np.zeros((15, 17), bool)
    inner[1:-1, 1:-1] = True
    for _ in range(20):
        state = solve(membrane, rays, ranges + rng.normal(size=255) * SPREAD)
        assert np.sqrt(np.mean((state.ranges - ranges)[inner.ravel()]**2)) < SPREAD / 2
        assert loads(membrane, state).max() < 0.45
        assert state.fluid_pressure == pytest.approx(2000, rel=0.02)
        assert not (state.touched > 0.5).any()


def test_a_membrane_with_new_reference_positions_is_in_balance_there(still):
    membrane, rays, ranges = still
    solve(membrane, rays, ranges)
    turned = rays + [2e-4, 0, 0]
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    membrane.set_rest(CAP.meet(ORIGIN, turned))
    membrane.core.reset(0.0)
    state = solve(membrane, turned, np.linalg.norm(membrane.core.rest - ORIGIN, axis=1))
    np.testing.assert_allclose(loads(membrane, state), 0, atol=1e-6)


def test_a_range_outlier_is_rejected_and_an_edge_is_kept(still):
    membrane, rays, ranges = still
    noisy = ranges + np.random.default_rng(1).normal(size=255) * 10e-6
    noisy[100] += 0.5e-3
    state = solve(membrane, rays, noisy, sigma=10e-6)
    assert abs(state.ranges[100] - ranges[100]) < 30e-6
    edge = ranges - 0.4e-3 * (np.arange(255) // 17 == 7)
    membrane.core.reset(0.0)
    assert np.median((ranges - solve(membrane, rays, edge).ranges)[edge < ranges]) > 0.25e-3


def test_unknown_ranges_unseen_dots_and_empty_frames_give_finite_results(still):
    membrane, rays, ranges = still
    ids = np.arange(0, 255, 2)
    spoiled = ranges[ids].copy()
    spoiled[::5] = np.nan
    state = solve(membrane, rays[ids], spoiled, ids)
    assert np.isfinite(state.xyz).all() and np.abs(state.ranges - ranges).reshape(15, 17)[1:-1, 1:-1].max() < 2e-5
    empty = solve(membrane, np.zeros((0, 3)), np.zeros(0), np.zeros(0, int))
    assert np.isfinite(empty.xyz).all() and not empty.seen.any()


def test_unseen_dots_move_with_their_neighbours(still):
    membrane, rays, ranges = still
    ids = np.setdiff1d(np.arange(255), [120, 121])
    turned = rays + [0.01, 0, 0]
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    state = solve(membrane, turned[ids], ranges[ids], ids)
    away = state.xyz[[120, 121]] - ORIGIN
    assert not state.seen[[120, 121]].any()
    np.testing.assert_allclose(away / np.linalg.norm(away, axis=1, keepdims=True), turned[[120, 121]], atol=1e-4)


def test_copies_are_independent_and_a_refused_frame_changes_nothing(still):
    membrane, rays, ranges = still
    solve(membrane, rays, ranges)
    other = copy.deepcopy(membrane.core)
    with pytest.raises(ValueError, match='ranges'):
        membrane.core.solve(rays, ranges[:-1], np.full(255, SPREAD), np.arange(255))
    np.testing.assert_array_equal(membrane.core.state.xyz, other.state.xyz)
    solve(membrane, rays, ranges - 1e-4)
    assert np.abs(other.state.ranges - ranges).max() < 1e-6 < np.abs(membrane.core.state.ranges - ranges).max()


def _follow(pad, frames, seed=0, scale_sigma=0.0, **errors):
    rng = np.random.default_rng(seed)
    material = MembraneMaterial(pad.info['shear_modulus_times_thickness'], pad.info['rest_gauge_pressure'], pad.info['curvature_radius'])
    membrane = Membrane(pad.rest, 23, 23, pad.camera.centre, material)
    membrane.core.reset(scale_sigma)
    for frame in frames:
        rays, ranges, _ = pad.measure(frame, rng, **errors)
        state = solve(membrane, rays, ranges)
    return membrane, state


def _force(membrane, state):
    found = membrane.core.loads(np.arange(529), state.xyz)
    return found.force[found.load > 0.25].sum(axis=0)


@pytest.mark.parametrize('name, frame, force_error', [('tp_rect_drag', 15, 0.10), ('tp_ring_press', 16, 0.06), ('tp_disc_twist', 20, 0.06)])
def test_positions_pressure_and_force_of_a_pressed_pad(touchpad, name, frame, force_error):
    pad = touchpad(name)
    membrane, state = _follow(pad, range(1, frame + 1), gain=0.01)
    truth = pad.truth
    assert np.sqrt(np.mean(np.sum((state.xyz - truth['dot_xyz'][frame])**2, axis=1))) < 30e-6
    assert state.fluid_pressure == pytest.approx(truth['pressure'][frame], rel=0.06)
    assert np.linalg.norm(_force(membrane, state) - truth['force'][frame]) < force_error * np.linalg.norm(truth['force'][frame])


def test_a_jump_of_the_surface_is_tracked_within_one_frame(touchpad):
    pad = touchpad('tp_calib')
    expected = pad.truth['force'][10]
    assert np.linalg.norm(_force(*_follow(pad, [6, 7, 10])) - expected) < 0.15 * np.linalg.norm(expected)


@pytest.mark.parametrize('name, gain', [('tp_disc_twist', 0.06), ('tp_rect_drag', -0.04), ('tp_rect_drag', 0.0)])
def test_a_common_scale_error_is_found_from_the_imbalance_of_forces(touchpad, name, gain):
    frames = [1, 3, 5, 7, *range(8, 31), *range(9, 31)]
    membrane, _ = _follow(touchpad(name), frames, 3, scale_sigma=0.05, spread=28e-6, gain=gain)
    assert membrane.core.scale * (1 + gain) == pytest.approx(1, abs=0.022)


def test_the_scale_stays_where_it_is_known_or_the_pad_is_untouched(touchpad):
    pad = touchpad('tp_rect_drag')
    assert _follow(pad, range(3, 13), 3, scale_sigma=0.0, gain=0.05)[0].core.scale == 1
    assert _follow(pad, [0, 1] * 6, 3, scale_sigma=0.05, gain=0.05)[0].core.scale == 1

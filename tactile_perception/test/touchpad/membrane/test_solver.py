# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.geometry import Cap
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.membrane.solver import Membrane, MembraneMaterial

ORIGIN = np.array([0.0, 0.0, -0.04])
CAP = Cap()
SPREAD = 30e-6


def _rest(rows=15, columns=17):
    y, x = np.meshgrid(np.linspace(-0.2, 0.2, rows), np.linspace(-0.22, 0.22, columns), indexing='ij')
    rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return CAP.meet(ORIGIN, rays), rays


def _at_rest():
    rest, rays = _rest()
    return Membrane(rest, 15, 17), rays, np.linalg.norm(rest - ORIGIN, axis=1)


def test_rest_places_of_another_shape_or_mostly_unknown_are_refused():
    rest, _ = _rest()
    with pytest.raises(BadArgument, match='rest_xyz'):
        Membrane(rest[:-1], 15, 17)
    rest[::2], rest[1::4] = np.nan, np.nan
    with pytest.raises(BadArgument, match='reference'):
        Membrane(rest, 15, 17)


def _carried(membrane, state):
    """Force (K, 3), N, of the object on each inner dot, and normal load (K,) over the fluid's pressure."""
    elastic, share = membrane.forces.elastic(state.xyz)
    residual = elastic + state.fluid_pressure * (share - membrane.forces.rest_residual)
    load = (residual * share).sum(axis=1) / (state.fluid_pressure * (share * share).sum(axis=1))
    return np.where(membrane.mesh.inner[:, None], -residual, 0.0), np.where(membrane.mesh.inner, load, 0.0)


def test_numbers_outside_the_grid_are_refused():
    membrane, rays, ranges = _at_rest()
    with pytest.raises(BadArgument, match='outside the grid'):
        membrane.solve(ORIGIN, rays[:1], ranges[:1], np.full(1, SPREAD), np.array([255]))


def test_rest_places_that_the_reference_lacks_are_filled_in():
    rest, _ = _rest()
    holed = rest.copy()
    holed[[30, 31, 100]] = np.nan
    np.testing.assert_allclose(Membrane(holed, 15, 17).rest, rest, atol=5e-5)


def test_an_untouched_membrane_takes_the_noise_off_the_ranges_and_carries_nothing():
    membrane, rays, ranges = _at_rest()
    rng, state = np.random.default_rng(0), None
    for _ in range(20):
        noisy = ranges + rng.normal(size=255) * SPREAD
        state = membrane.solve(ORIGIN, rays, noisy, np.full(255, SPREAD), np.arange(255), state)
        inner = membrane.mesh.inner
        assert np.sqrt(np.mean((state.ranges - ranges)[inner]**2)) < SPREAD / 2
        assert _carried(membrane, state)[1].max() < 0.45
        assert state.fluid_pressure == pytest.approx(2000, rel=0.02)
        assert not (state.touched > 0.5).any()


def test_a_membrane_with_other_rest_places_is_at_rest_there():
    membrane, rays, ranges = _at_rest()
    membrane.solve(ORIGIN, rays, ranges, np.full(255, SPREAD), np.arange(255))
    turned = rays + [2e-4, 0, 0]
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    other = membrane.with_rest(CAP.meet(ORIGIN, turned))
    state = other.solve(ORIGIN, turned, np.linalg.norm(other.rest - ORIGIN, axis=1), np.full(255, SPREAD), np.arange(255))
    np.testing.assert_allclose(_carried(other, state)[1], 0, atol=1e-6)


def test_a_range_that_glare_has_spoiled_is_not_believed():
    membrane, rays, ranges = _at_rest()
    rng = np.random.default_rng(1)
    noisy = ranges + rng.normal(size=255) * 10e-6
    noisy[100] += 0.5e-3
    state = membrane.solve(ORIGIN, rays, noisy, np.full(255, 10e-6), np.arange(255))
    assert abs(state.ranges[100] - ranges[100]) < 30e-6


def test_unknown_ranges_unseen_dots_and_empty_frames_leave_finite_numbers():
    membrane, rays, ranges = _at_rest()
    ids = np.arange(0, 255, 2)
    spoiled = ranges[ids].copy()
    spoiled[::5] = np.nan
    state = membrane.solve(ORIGIN, rays[ids], spoiled, np.full(len(ids), SPREAD), ids)
    assert np.isfinite(state.xyz).all() and np.isfinite(_carried(membrane, state)[0]).all()
    assert np.abs(state.ranges - ranges)[membrane.mesh.inner].max() < 2e-5
    empty = membrane.solve(ORIGIN, np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0, int), state)
    assert np.isfinite(empty.xyz).all() and not empty.seen.any()


def test_dots_not_seen_move_as_their_neighbours():
    membrane, rays, ranges = _at_rest()
    ids = np.setdiff1d(np.arange(255), [120, 121])
    turned = rays + [0.01, 0, 0]
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    state = membrane.solve(ORIGIN, turned[ids], ranges[ids], np.full(253, SPREAD), ids)
    away = state.xyz[[120, 121]] - ORIGIN
    assert not state.seen[[120, 121]].any()
    np.testing.assert_allclose(away / np.linalg.norm(away, axis=1, keepdims=True), turned[[120, 121]], atol=1e-4)


def _follow(pad, frames, seed=0, **errors):
    rng = np.random.default_rng(seed)
    material = MembraneMaterial(pad.info['shear_modulus_times_thickness'], pad.info['rest_gauge_pressure'], pad.info['curvature_radius'])
    membrane, state = Membrane(pad.rest, 23, 23, material), None
    for frame in frames:
        rays, ranges, _ = pad.measure(frame, rng, **errors)
        state = membrane.solve(pad.camera.centre, rays, ranges, np.full(529, SPREAD), np.arange(529), state)
    return membrane, state


def _wrench(membrane, state):
    force, load = _carried(membrane, state)
    carried = force * (load > 0.25)[:, None]
    return carried.sum(0), np.cross(state.xyz, carried).sum(0)


@pytest.mark.parametrize('name, frame, force_error', [('tp_rect_drag', 15, 0.10), ('tp_ring_press', 16, 0.06), ('tp_disc_twist', 20, 0.06)])
def test_places_pressure_and_force_of_a_pressed_pad(touchpad, name, frame, force_error):
    pad = touchpad(name)
    membrane, state = _follow(pad, range(1, frame + 1), gain=0.01)
    truth = pad.truth
    assert np.sqrt(np.mean(np.sum((state.xyz - truth['dot_xyz'][frame])**2, axis=1))) < 30e-6
    assert state.fluid_pressure == pytest.approx(truth['pressure'][frame], rel=0.06)
    force, moment = _wrench(membrane, state)
    assert np.linalg.norm(force - truth['force'][frame]) < force_error * np.linalg.norm(truth['force'][frame])
    assert np.linalg.norm(moment - truth['moment_sensor'][frame]) < 1e-3


def test_a_jump_of_the_surface_is_followed_within_one_frame(touchpad):
    pad = touchpad('tp_calib')
    membrane, state = _follow(pad, [6, 7, 10])
    expected = pad.truth['force'][10]
    assert np.linalg.norm(_wrench(membrane, state)[0] - expected) < 0.15 * np.linalg.norm(expected)

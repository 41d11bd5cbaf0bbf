# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadCalibration
from tactile_perception.press.published.marker_depth import MarkerDepths, fit_marker_depths, rising_cubic, weights
from tactile_perception.press.presses import Presses
from tactile_perception.press.field import MarkerField

HEIGHT, PITCH = 0.06, 4.5e-3
GRID = np.stack(np.meshgrid(np.arange(-4, 5) * PITCH, np.arange(-3, 4) * PITCH), -1).reshape(-1, 2)


def field(depth):
    """All markers seen as deep as depth (K,) or a number, m."""
    depth = np.broadcast_to(np.asarray(depth, float), len(GRID))
    shift = GRID * (depth / (HEIGHT - depth))[:, None]
    eye = np.tile([0.0, 0.0, -HEIGHT], (len(GRID), 1))
    plain = np.full(len(GRID), 1e-6)
    return MarkerField(GRID, shift, 2 * np.log(HEIGHT / (HEIGHT - depth)), eye, plain, GRID, shift, plain)


def presses(markers, depths):
    pressed = [(marker, depth) for marker in markers for depth in depths]
    position = np.array([[*GRID[marker], -depth] for marker, depth in pressed])
    count = len(pressed)
    return Presses(tuple(field(depth) for _, depth in pressed), position, np.array([depth for _, depth in pressed]), np.arange(count),
                   np.full((count, 6), np.nan), np.full(count, np.nan))


def test_a_cubic_is_found_again():
    x = np.linspace(0.1, 0.8, 8)
    truth = 0.01 * x + 0.004 * x**2 + 0.002 * x**3
    cubic = rising_cubic(x, truth)
    assert np.abs(cubic(x)[0] - truth).max() < 1e-12 and cubic.sigma < 1e-12 and not cubic(x)[1].any()


def test_beyond_the_range_it_is_clamped_and_flagged():
    cubic = rising_cubic(np.array([0.2, 0.5, 1.0]), np.array([1e-3, 2e-3, 4e-3]))
    depth, outside = cubic(np.array([-0.5, 0.0, 1.0, 3.0]))
    assert outside.tolist() == [True, False, False, True]
    assert depth == pytest.approx([0.0, 0.0, 4e-3, 4e-3])


def test_what_would_fall_within_the_range_is_fitted_by_a_lower_degree():
    cubic = rising_cubic(np.array([0.2, 0.5, 0.8, 1.0]), np.array([3e-3, 2e-3, 1.5e-3, 4e-3]))
    x = np.linspace(0, 1, 50)
    assert (np.diff(cubic(x)[0]) > 0).all()


def test_nothing_rises_without_change():
    assert rising_cubic(np.zeros(3), np.array([1e-3, 2e-3, 3e-3])) is None


def test_weights_lean_to_the_surer_and_never_divide_by_zero():
    assert weights(1.0, 3.0) == (0.75, 0.25)
    assert weights(0.0, 0.0) == (0.5, 0.5)
    assert weights(np.nan, 1.0) == (0.0, 1.0) and weights(1.0, np.nan) == (1.0, 0.0)


def test_markers_without_presses_borrow_from_their_neighbours():
    corners = [0, 8, 54, 62, 30]
    fitted = fit_marker_depths(presses(corners, [2e-3, 4e-3, 6e-3, 8e-3]), PITCH)
    depth, outside = fitted.depths(field(5e-3))
    assert np.abs(depth - 5e-3).max() < 2e-5 and not outside.any()
    assert fitted.depths(field(9.5e-3))[1].all()
    assert np.abs(fitted.depths(field(0.0))[0]).max() < 1e-9


def test_a_marker_that_is_not_seen_is_not_told():
    fitted = fit_marker_depths(presses([0, 30, 62], [2e-3, 4e-3, 6e-3]), PITCH)
    seen = field(3e-3)
    seen.shift[5], seen.growth[5] = np.nan, np.nan
    depth, _ = fitted.depths(seen)
    assert np.isnan(depth[5]) and np.isfinite(np.delete(depth, 5)).all()
    seen.growth[7] = np.nan  # its displacement still tells
    assert fitted.depths(seen)[0][7] == pytest.approx(3e-3, abs=2e-5)


def test_numbers_come_back():
    fitted = fit_marker_depths(presses([0, 31, 62], [2e-3, 4e-3, 6e-3]), PITCH)
    again = MarkerDepths.from_numbers(fitted.numbers())
    assert np.array_equal(again.depths(field(3e-3))[0], fitted.depths(field(3e-3))[0])


def test_presses_beside_all_markers_are_refused():
    beside = presses([0], [2e-3])
    beside.position[:] += 0.02
    far = Presses(beside.fields, beside.position + [0.1, 0, 0], beside.depth, beside.segment, beside.wrench, beside.radius)
    with pytest.raises(BadCalibration, match='under a press'):
        fit_marker_depths(far, PITCH)
    with pytest.raises(BadCalibration, match='cannot be read'):
        MarkerDepths.from_numbers({'rows': [{}]})

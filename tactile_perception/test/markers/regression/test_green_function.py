# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.markers.regression.green_function import SheetBell, _Places
from tactile_perception.markers.view.sensor import MARKER_SENSORS

SIZE = np.array([0.060, 0.045])
GRID = MARKER_SENSORS['areal_single'].grid()
EYE = np.tile([0.0, 0.0, -0.062], (len(GRID), 1))


def parameters(x, y, depth, width=3e-3, power=1.0):
    return np.array([[x, y, np.log(depth), np.log(width), np.log(power)]])


def bell(radius=1e-9, draw=(0, 0, 0)):
    return SheetBell(SIZE, GRID, EYE, radius, draw)


def test_the_bell_is_as_deep_as_told_and_nothing_at_the_clamp():
    deep, _, _ = bell().bell(parameters(4.5e-3, -9e-3, 6e-3))
    assert deep[0, np.argmin(np.hypot(*(GRID - [4.5e-3, -9e-3]).T))] == pytest.approx(6e-3, rel=1e-9)
    edge = np.array([[0.03, 0.01], [-0.03, 0.0], [0.01, 0.0225], [0.02, -0.0225]])
    value, _ = _Places(edge * (1 - 1e-9), SIZE).green(np.array([[4.5e-3, -9e-3]]), np.array([3e-3]), 4)
    assert np.abs(value).max() < 1e-4


def test_it_is_the_sharp_shape_of_a_clamped_membrane_far_from_the_tip(membrane):
    far = GRID[np.hypot(*(GRID - [9e-3, 4.5e-3]).T) > 9e-3]
    value, _ = _Places(far, SIZE).green(np.array([[9e-3, 4.5e-3]]), np.array([1e-6]), len(far))
    truth = membrane(far, np.array([9e-3, 4.5e-3]), 1.0)
    assert np.ptp(value[0] / truth) / np.mean(value[0] / truth) < 0.01


def test_slopes_are_the_derivatives():
    places, source, width, h = np.array([[1e-3, 2e-3], [15e-3, -10e-3]]), np.array([[4e-3, -3e-3]]), np.array([3e-3]), 1e-8

    def value(off):
        return _Places(places + off, SIZE).green(source, width, 2)[0][0]
    _, slope = _Places(places, SIZE).green(source, width, 0)
    numeric = np.stack([(value([h, 0]) - value([-h, 0])) / 2 / h, (value([0, h]) - value([0, -h])) / 2 / h], axis=-1)
    assert slope[0] == pytest.approx(numeric, rel=1e-5)


def test_a_marker_appears_further_out_by_its_depth():
    told, deep = bell().predict(parameters(9e-3, 0, 5e-3))
    assert told.reshape(-1, 2) == pytest.approx(GRID * (deep[0] / (0.062 - deep[0]))[:, None])


def test_the_sheet_is_drawn_towards_a_dent_but_not_under_the_tip():
    free, held = (bell(draw=draw).predict(parameters(0, 0, 5e-3))[0].reshape(-1, 2) for draw in ((0, 1, 0), (0, 1, 1)))
    plain = bell().predict(parameters(0, 0, 5e-3))[0].reshape(-1, 2)
    far = np.argmin(np.hypot(*(GRID - [18e-3, 0]).T))
    assert (free - plain)[far, 0] < -1e-5
    beside = bell(draw=(0, 1, 1)).predict(parameters(18e-3, 0, 5e-3))[0] - bell().predict(parameters(18e-3, 0, 5e-3))[0]
    assert np.hypot(*beside.reshape(-1, 2)[far]) < 5e-6
    assert np.abs(free - held).max() < 5e-6  # in the middle nothing has to be held


def test_drawings_add_up_as_their_factors_say():
    some = bell(draw=(0.4, 0.3, 0.9))
    plain, drawn = some.appear(parameters(-9e-3, 6e-3, 8e-3))
    assert some.predict(parameters(-9e-3, 6e-3, 8e-3))[0].ravel() == pytest.approx((plain + drawn @ some.draw).ravel(), abs=1e-15)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses looked up, shown and fitted by the kernels, against NumPy."""
import numpy as np
import pytest
from sheet_reference import appearance, disc, looked_up, read_field
from sheet_scenes import EYE, GRID, library
from tactile_perception import _core
from tactile_perception.press.sheet.library import Press, field_appearance
from tactile_perception.press.sheet.fit import show

ONE = Press(np.array([0.011, -0.006]), 4e-3, 0.08, (0.3, -0.2))


def fit(value, start, drags=True, sigma=None, noise=(1e-6, 1e-3, 1e-4, 1e-2), motion=None):
    sigma, motion = np.zeros(len(GRID)) if sigma is None else sigma, np.zeros((len(GRID), 3)) if motion is None else motion
    return _core.fit_presses(library().table, GRID, EYE, value, sigma, motion, np.array([press.vector for press in start]),
                             noise=(*noise, 0.0, 0.0),
                             tip=(0.0, 0.15), marker_radius=0.0, drags=drags, near=0.0)


def test_a_disc_is_the_mean_over_its_points():
    radius, near = 1.2e-3, np.argsort(np.hypot(*(GRID - ONE.place).T))[:12]
    rest, eye, field = GRID[near], EYE[near], looked_up(library(), ONE)[0]
    seen = field_appearance(field, library().plan, ONE.place, rest, eye, radius)
    points = (rest[:, None] + disc(radius)).reshape(-1, 2)
    each = appearance(read_field(field, library().plan, ONE.place, points), points, np.repeat(eye, 1000, axis=0))
    area, places = np.exp(each[:, 2]).reshape(12, 1000), (each[:, :2] + points).reshape(12, 1000, 2)
    centroid = (places * area[..., None]).sum(1) / area.sum(1)[:, None] - rest
    assert np.abs(seen[:, :2] - centroid).max() < 1e-5 and np.abs(seen[:, 2] - np.log(area.mean(1))).max() < 0.02
    whole, _ = show(library(), [ONE], rest, eye, marker_radius=radius, near=1.0)
    assert whole == pytest.approx(seen, abs=1e-6)


@pytest.mark.parametrize('late', [-0.15, 0.0, 0.15])
def test_markers_that_are_late_by_an_unknown_share_of_their_motion_tell_the_press(late):
    """The right half is seen while the tip is on its way from BEFORE to ONE, and beyond."""
    before = Press(ONE.place - [1.5e-3, 0.0], ONE.depth - 5e-4, ONE.log_radius, ONE.drag)
    value, last = (show(library(), [press], GRID, EYE)[0] for press in (ONE, before))
    motion = np.where(GRID[:, :1] > 0.0, value - last, 0.0)
    seen = value - late * motion
    state, covariance, _, _ = fit(seen, [ONE], motion=motion)
    assert state.shape == (6,) and covariance.shape == (6, 6)
    error, without = (np.hypot(*(found[:2] - ONE.place)) for found in (state, fit(seen, [ONE])[0]))
    assert error < 1e-5 + 0.1 * without
    assert covariance[0, 0] > 2 * fit(seen, [ONE])[1][0, 0], 'less is known of the place along the motion'


def test_markers_that_are_unknown_or_wild_change_little():
    value = show(library(), [ONE], GRID, EYE)[0] + np.random.default_rng(1).normal(0, 1, (len(GRID), 3)) * [5e-6, 5e-6, 2e-3]
    value[::9, 2], value[::17] = np.nan, np.inf
    value[5] += 1e-3
    state, _, misfit, _ = fit(value, [Press(ONE.place + 1e-3, 3e-3)], noise=(5e-6, 2e-3, 1e-3, 1.0))
    assert np.abs(state[:3] - ONE.vector[:3]).max() < 2e-4 and np.isfinite(misfit)


def test_markers_of_which_nothing_is_known_leave_the_start():
    state, covariance, misfit, _ = fit(np.full((len(GRID), 3), np.nan), [ONE])
    assert state == pytest.approx(ONE.vector) and misfit == 0 and covariance.shape == (6, 6)

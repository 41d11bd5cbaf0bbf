# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.markers.regression.green_function import SheetBell
from tactile_perception.markers.regression.green_function_fit import BellFitter, broad_prior
from tactile_perception.markers.view.sensor import MARKER_SENSORS

SIZE = np.array([0.060, 0.045])
GRID = MARKER_SENSORS['areal_single'].grid()
SIGMA = np.full(len(GRID), 3e-6)


@pytest.fixture(scope='module')
def fitter():
    bell = SheetBell(SIZE, GRID, np.tile([0.0, 0.0, -0.062], (len(GRID), 1)), 1.2e-3, (0.4, 0.4, 0.8))
    return BellFitter(bell, GRID, broad_prior(SIZE))


def shown(fitter, truth, seed=0):
    told, _ = fitter.bell.predict(np.array(truth)[None])
    return told.reshape(-1, 2) + np.random.default_rng(seed).normal(0, 3e-6, GRID.shape)


@pytest.mark.parametrize('place', [(0.0, 0.0), (14e-3, -7e-3), (-20e-3, 13e-3)])
@pytest.mark.parametrize('depth', [1e-3, 10e-3])
def test_its_own_bell_is_found_again(fitter, place, depth):
    truth = [*place, np.log(depth), np.log(3e-3), 0.0]
    fit = fitter.fit(shown(fitter, truth), SIGMA, np.array([place[0] + 2e-3, place[1] - 2e-3, np.log(depth) + 0.3]))
    off = fit.parameters[:3] - truth[:3]
    assert np.abs(off[:2]).max() < 3e-4 and abs(off[2]) < 0.2
    assert (off**2 / np.diag(fit.covariance)[:3]).mean() < 4 and fit.misfit < 1.5


def test_markers_that_are_not_seen_are_left_out(fitter):
    truth = [5e-3, 5e-3, np.log(5e-3), np.log(3e-3), 0.0]
    shift = shown(fitter, truth)
    whole = fitter.fit(shift, SIGMA, np.array(truth[:3]))
    shift[::5] = np.nan
    part = fitter.fit(shift, SIGMA, np.array(truth[:3]))
    assert np.hypot(*(part.parameters[:2] - truth[:2])) < 3e-4 and part.covariance[0, 0] > whole.covariance[0, 0]


def test_held_place_and_depth_stay(fitter):
    start = np.array([5e-3, 5e-3, np.log(5e-3)])
    fit = fitter.fit(shown(fitter, [*start, np.log(2e-3), 0.0]), SIGMA, start, hold=True)
    assert np.array_equal(fit.parameters[:3], start) and np.exp(fit.parameters[3]) == pytest.approx(2e-3, rel=0.15)


def test_a_sheet_that_is_carried_along_is_told_from_a_press_elsewhere(fitter):
    truth = [5e-3, -4e-3, np.log(5e-3), np.log(3e-3), 0.0, 1.5e-3, -0.8e-3]
    start = np.array([4e-3, -2e-3, np.log(4e-3)])
    plain = fitter.fit(shown(fitter, truth), SIGMA, start)
    fit = BellFitter(fitter.bell, GRID, fitter.prior, drag=2e-3).fit(shown(fitter, truth), SIGMA, start)
    assert np.hypot(*(fit.parameters - truth)[:2]) < 3e-4 < 1e-3 < np.hypot(*(plain.parameters[:2] - truth[:2]))
    assert fit.parameters[5:] == pytest.approx(truth[5:], abs=2e-4) and not plain.parameters[5:].any()

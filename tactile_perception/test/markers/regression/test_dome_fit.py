# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_scenes import BALL, DOME, EYE, NOISE, RADIUS, calibration, dome_field, markers, seen
from tactile_perception.markers.regression.dome_basis import Dent, DentFit
from tactile_perception.markers.regression.dome_fit import DentSolver
from tactile_perception.markers.view.sensor import dome_cap

DEEPEST = 0.038


@pytest.fixture(scope='module')
def solver():
    rest, presses = markers(), calibration()
    presses = presses.select(presses.touching)
    dent = Dent(seen(rest), np.tile(EYE, (len(rest), 1)), rest, dome_cap(DOME), DOME.plane_z, BALL / (RADIUS + BALL), DEEPEST / 2)
    fit = DentFit(dent, [field.shift for field in presses.fields], presses.position[:, :2], presses.depth)
    return DentSolver(dent.with_coefficients(fit.coefficients(1e-5)), NOISE, DEEPEST, max(DOME.pitch))


def test_a_dent_stands_out_of_the_noise_by_far(solver):
    assert solver.score(dome_field([((0.02, 0.01), 0.005)])) > 30
    assert max(solver.score(dome_field(seed=k)) for k in range(50)) < 6


def test_the_start_is_near(solver):
    start, = solver.start(dome_field([((0.03, 0.02), 0.02)]))
    assert np.hypot(*(start[:2] - [0.03, 0.02])) < 0.012 and np.exp(start[2]) == pytest.approx(0.02, rel=0.5)


def test_the_start_of_two_is_near(solver):
    field = dome_field()
    truth = np.array([[0.03, 0.02, np.log(0.02), np.log(0.02)], [-0.03, 0.0, np.log(0.015), np.log(0.015)]])
    field.shift[:] = solver.dent.seen_at(sum(solver.dent.moved(one) for one in truth))
    two = solver.start_of_two(field)
    off = np.hypot(*(two[:, None, :2] - truth[:, :2]).transpose(2, 0, 1))
    assert off.min(axis=0).max() < 0.04


def test_its_own_dent_is_found_to_nothing(solver):
    truth = np.array([0.021, -0.013, np.log(0.017), np.log(0.017)])
    field = dome_field()
    field.shift[:] = solver.dent.appear(truth)
    found = solver.solve(field, solver.start(field))
    assert found.parameters[0] == pytest.approx(truth, abs=2e-4) and found.squares < 1e-3
    assert found.covariance.shape == (4, 4) and np.sqrt(found.covariance[0, 0]) < 0.3e-3


def test_two_of_its_own_are_found_together(solver):
    truth = np.array([[0.03, 0.0, np.log(0.02), np.log(0.02)], [-0.025, 0.01, np.log(0.012), np.log(0.012)]])
    field = dome_field()
    field.shift[:] = solver.dent.seen_at(sum(solver.dent.moved(one) for one in truth))
    found = solver.solve(field, solver.start_of_two(field))
    order = np.argsort(-found.parameters[:, 0])
    assert found.parameters[order] == pytest.approx(truth, abs=1e-3) and found.covariance.shape == (8, 8)


def test_a_dent_that_nothing_shows_stops_nothing(solver):
    field = dome_field([((0.03, 0.0), 0.02)])
    none = np.array([[0.03, 0.0, np.log(0.02), np.log(0.02)], [-0.08, 0.0, -13.5, -13.5]])
    found = solver.solve(field, none)
    assert np.isfinite(found.parameters).all() and np.isfinite(found.covariance).all()
    assert np.hypot(*(found.parameters[0, :2] - [0.03, 0.0])) < 1.5e-3
    field.shift[:] = np.random.default_rng(2).uniform(-0.1, 0.1, field.shift.shape)
    wild = solver.solve(field, solver.start_of_two(field))
    assert np.isfinite(wild.parameters).all() and np.hypot(*wild.parameters[:, :2].T).max() < 0.22

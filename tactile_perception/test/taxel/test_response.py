# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadCalibration
from tactile_perception.taxel.calibration import fit_gains, fit_response
from tactile_perception.taxel.response import Response
from taxel_pictures import bar, picture

GAIN = 1 + 0.08 * np.random.default_rng(2).normal(size=(44, 44))


def test_gains_come_back_from_even_loads():
    loads = np.array([20, 60, 100, 160.0])
    found = fit_gains(loads[:, None, None] * GAIN)
    assert np.abs(found / found.mean() - GAIN / GAIN.mean()).max() < 1e-3


def test_no_gains_from_a_stamp():
    assert fit_gains(np.stack([picture(bar(), load) for load in (20, 50, 100)])) is None


def test_unseen_weights_on_a_stamp():
    truth = Response((500.0, 0.8, 2000.0), 5.0)
    changes = np.array([picture(bar(), load) for load in (10, 20, 40, 60, 80, 100.0)], np.float64)
    forces = 1e-6 * np.array([truth.pressure(image).sum() for image in changes])
    response, _ = fit_response(changes[::2], forces[::2], 1e-6)
    assert response.known
    assert [1e-6 * response.pressure(image).sum() for image in changes[1::2]] == pytest.approx(forces[1::2], rel=1e-2)


def test_slope_is_the_pressures():
    response = Response((500.0, 0.8, 2000.0), 5.0)
    step = response.pressure(np.array([[10.25]])) - response.pressure(np.array([[9.75]]))
    assert response.slope(10.0) == pytest.approx(step[0, 0] / 0.5, rel=1e-3)


def test_one_weight_is_not_enough():
    with pytest.raises(BadCalibration, match='at least 3'):
        fit_response(np.ones((4, 3, 3)), np.full(4, 2.0), 1e-6)


@pytest.mark.parametrize('scale', [(0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (np.nan, 0.0, 0.0), (1.0,)])
def test_wrong_scale(scale):
    with pytest.raises(BadArgument):
        Response(scale)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_library import EYES, POINTS
from dome_scenes import DOME, dome_presses
from tactile_perception.errors import BadCalibration
from tactile_perception.press.dome import identification, membrane
from tactile_perception.press.dome.identification import DomeNumbers, identify, load_steps, seen_at
from tactile_perception.press.dome.membrane import DomeMaterial
from tactile_perception.press.sensor import dome_cap

CAP, START = dome_cap(DOME), DomeNumbers(DomeMaterial(0.7, 70.0, 0.5), 0.025)


def test_logs_give_the_numbers_back_within_bounds():
    again = DomeNumbers.from_logs(START.logs)
    assert np.allclose(again.logs, START.logs)
    assert DomeNumbers.from_logs(START.logs + 9).material.squeeze == 0 and DomeNumbers.from_logs(START.logs - 9).material.squeeze < 1


def test_load_steps_go_through_the_depths_without_long_strides():
    stops = np.array([0.0101, 0.02, 0.035])
    steps = load_steps(stops)
    assert set(stops) <= set(steps) and np.diff(steps).min() > 1e-4 and np.diff(steps).max() < 0.05 * stops[-1]


def test_a_ray_meets_the_viewing_plane():
    assert np.allclose(seen_at(np.array([[0.02, 0.01, 0.0]]), np.array([[0.0, 0.01, -0.1]]), 0.1), [[0.04, 0.01]])


@pytest.mark.full  # simulates presses
@pytest.mark.parametrize('tension, gas, friction, across', [(0.3, 70.0, 0.4, 0.05), (1.0, 70.0, 0.2, 0.07), (0.6, 0.0, 0.4, 0.05)])
def test_tension_gas_and_friction_are_told_from_simulated_presses(monkeypatch, tension, gas, friction, across):
    """Also where the skin would stick all over at the friction of the start, so that a little more or less would change nothing, and where
    the pressure is held."""
    monkeypatch.setattr(identification, 'LOAD_STEPS', 10)
    monkeypatch.setattr(identification, 'GASES', (1.0, 1e-4))
    presses, true = dome_presses([(0.0, 0.0), (across, 0.0)], (0.012, 0.025), still=0), np.log([tension, max(gas, 1e-3), friction, 0.025])
    known = dict(points=POINTS, eyes=np.nan_to_num(EYES), cap=CAP, plane_z=DOME.plane_z, marker=0.004)
    for place in identification._places(presses):  # what the true dome would have shown
        left = identification._residuals((place, true), **known).reshape(place.shifts.shape) / place.weights[:, None, None]
        for depth, shift in zip(place.depths, place.shifts + left):
            presses.fields[np.flatnonzero(np.isclose(presses.depth, depth, atol=1e-6)
                                          & np.isclose(np.hypot(*presses.position[:, :2].T), place.across))[0]].shift[:] = shift
    found = identify(presses, start=START, **known).logs
    assert np.exp(found[1]) < 0.1 if gas == 0 else np.exp(found[1]) > 30
    assert found[0] == pytest.approx(true[0], abs=0.2) and found[2] == pytest.approx(true[2], abs=0.2)


def test_presses_that_cannot_be_simulated_are_refused(monkeypatch):
    monkeypatch.setattr(membrane, 'STEPS', 1)
    monkeypatch.setattr(identification, 'LOAD_STEPS', 1)
    with pytest.raises(BadCalibration, match='do not converge'):
        identify(dome_presses([(0.0, 0.0)], (0.012,), still=0), POINTS, np.nan_to_num(EYES), CAP, DOME.plane_z, 0.004, START)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from changed_constants import changed
from dome_library import EYES, MESH, POINTS, library_field, press, small_library
from dome_scenes import DOME, SIX_POSITIONS, dome_presses

from tactile_perception.common.marker_sensor import MARKER_SENSORS, dome_cap
from tactile_perception.core.errors import BadCalibration
from tactile_perception.press import constants
from tactile_perception.press.dome import calibration
from tactile_perception.press.dome.calibration import PrintedDome, calibrate_dome, identify_dome, load_steps
from tactile_perception.press.dome.mechanics import DomeMaterial, DomeMesh, OnMesh, appear_at, outlines, press_dome, shift_of
from tactile_perception.press.dome.model import DomeCalibration, FieldNoise
from tactile_perception.press.presses import Presses


def known():
    """A calibration with a known library."""
    return DomeCalibration(small_library(), np.zeros((0, 2)), np.zeros((0, 3)), FieldNoise(1e-5, 0.0, 0.0), *[0.0] * 9)


@pytest.mark.full  # simulates a small library
def test_noise_and_errors_follow_from_the_presses():
    plain = dome_presses(SIX_POSITIONS, (0.012, 0.025))
    pressed = [(position, depth) for position in SIX_POSITIONS for depth in (0.012, 0.025)]
    fields = [library_field(seed=k) for k in range(3)] + [library_field(press(*position, depth), seed=k) for k, (position, depth) in
                                                          enumerate(pressed)]
    presses = Presses(tuple(fields), plain.position, plain.depth)
    found = calibrate_dome(presses, DOME, known())
    assert found.noise.still == pytest.approx(1.5e-5, rel=0.3) and found.noise.share < 0.006
    assert found.place_error < 1e-3 and found.depth_share < 0.05 and found.deepest == 0.025 and found.quiet < 6
    quick = calibrate_dome(presses, DOME, found)
    assert quick.library is found.library and quick.noise == found.noise


@pytest.mark.full  # simulates a small library
def test_scales_of_position_and_depth_are_corrected():
    """Presses that show the fields of others, which are farther out and deeper by 10 %."""
    positions, depths = [(x, y) for x in (-0.05, -0.02, 0.01, 0.04) for y in (-0.04, 0.0, 0.03)], (0.008, 0.015, 0.03)
    pressed = [(np.array(position), depth) for position in positions for depth in depths]
    fields = [library_field(press(*(0.97 * position), 1.1 * depth), seed=k) for k, (position, depth) in enumerate(pressed)]
    position, depth = np.array([[*position, 0.1] for position, _ in pressed]), np.array([one for _, one in pressed])
    presses = Presses(tuple(fields), position, depth)
    found = calibrate_dome(presses, DOME, known())
    assert found.wider == pytest.approx(0.97, abs=0.01)
    assert found.depth_scale(np.array([0.02, 0.01]), 0.022) == pytest.approx(1.1, abs=0.02)


def test_a_sheet_and_too_few_presses_are_refused():
    for presses, sensor in ((dome_presses(SIX_POSITIONS, (0.012,)), MARKER_SENSORS['areal_single']),
                            (dome_presses([(0, 0)], (0.01,)), DOME)):
        with pytest.raises(BadCalibration, match='needs a dome and 6 straight presses'):
            calibrate_dome(presses, sensor)


CAP, MARKER, TIP = dome_cap(DOME), 0.004, 0.025
PRINTED = PrintedDome(POINTS, np.nan_to_num(EYES), CAP, DOME.plane_z, MARKER)


@pytest.mark.full  # simulates presses
def test_tension_gas_and_friction_are_identified_from_simulated_presses(monkeypatch):
    """The pressure is constant, although the prior favours sealed gas."""
    monkeypatch.setattr(calibration, 'MeshPlan', lambda: MESH)  # coarse
    presses, true = dome_presses([(0.0, 0.0), (0.05, 0.0)], (0.012, 0.025), still=0), DomeMaterial(0.4, 0.0, 0.4)
    known = np.isfinite(POINTS).all(1)
    rest, eyes = outlines(POINTS[known], MARKER, CAP), EYES[known]
    for position in presses.some(2, 2):  # what the true dome would have shown
        mesh, steps = DomeMesh(shift_of(position.position[0, 0], TIP, CAP), CAP, MESH), load_steps(position.depth)
        straight = press_dome(mesh, steps, TIP, true, drags=0).straight[np.searchsorted(steps, position.depth)]
        for field, shown in zip(straight, position.fields):
            moved = OnMesh(mesh, rest.reshape(-1, 3)).displaced(field).reshape(rest.shape)
            shown.shift[known] = (appear_at(rest + moved, eyes) - appear_at(rest, eyes)) * (DOME.plane_z - eyes[:, 2:])
    with changed(constants.DOME, gas_starts=(70.0, 0.01)):
        material, radius = identify_dome(presses, PRINTED, TIP)
    assert material.gas < 3.0 and 1 - material.squeeze == pytest.approx(0.6, rel=0.2)
    assert material.friction == pytest.approx(0.4, rel=0.2) and radius == pytest.approx(TIP, rel=0.03)


def test_presses_that_cannot_be_simulated_are_refused():
    with changed(constants.DOME, max_newton_steps=1, load_steps=1), pytest.raises(BadCalibration, match='do not converge'):
        identify_dome(dome_presses([(0.0, 0.0)], (0.012,), still=0), PRINTED, TIP)

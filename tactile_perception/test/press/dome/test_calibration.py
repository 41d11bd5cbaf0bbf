# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from dome_library import EYES, MATERIAL, MESH, POINTS, library_field, press, small_library
from dome_scenes import DOME, EYE, FEW, PX, dome_presses, markers
from tactile_perception.errors import BadCalibration
from tactile_perception.press.dome import calibration, mechanics
from tactile_perception.press.dome.calibration import DomeCalibration, DomeNumbers, calibrate_dome, identify_dome
from tactile_perception.press.dome.fit import DomeFound, FieldNoise
from tactile_perception.press.dome.mechanics import DomeMaterial
from tactile_perception.press.presses import Presses
from tactile_perception.press.sensor import MARKER_SENSORS, dome_cap


@pytest.mark.full  # simulates a small library
def test_noise_and_errors_are_those_of_the_presses(monkeypatch):
    monkeypatch.setattr(calibration, '_simulated', lambda *_: (small_library(), MATERIAL))
    plain = dome_presses(FEW, (0.012, 0.025))
    pressed = [(place, depth) for place in FEW for depth in (0.012, 0.025)]
    fields = [library_field(seed=k) for k in range(3)] + [library_field(press(*place, depth), seed=k) for k, (place, depth) in
                                                          enumerate(pressed)]
    presses = Presses(tuple(fields), plain.position, plain.depth, plain.segment, plain.wrench, plain.radius)
    found = calibrate_dome(presses, DOME)
    assert found.noise.still == pytest.approx(1.5e-5, rel=0.3) and found.noise.share < 0.006
    assert found.place_error < 1e-3 and found.depth_share < 0.05 and found.deepest == 0.025 and found.quiet < 6
    quick = calibrate_dome(presses, DOME, found)
    assert quick.library is found.library and quick.noise == found.noise
    numbers = found.numbers()
    again = DomeCalibration.from_numbers(numbers)
    assert again.depth_error == found.depth_error and np.array_equal(again.rest, found.rest, equal_nan=True)
    with pytest.raises(BadCalibration, match='depth_error'):
        DomeCalibration.from_numbers({name: part for name, part in numbers.items() if name != 'depth_error'})


def known():
    """A calibration without remaining errors."""
    return DomeCalibration(small_library(), MATERIAL, np.zeros((0, 2)), np.zeros((0, 3)), FieldNoise(1e-5, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0,
                           1.0, 1.0, 0.0, 0.04, 0.08, 0.0)


@pytest.mark.full  # simulates a small library
def test_scales_of_place_and_depth_are_those_of_the_presses_and_none_where_they_were_not():
    rng, deepest, farthest = np.random.default_rng(1), 0.04, 0.08

    def scaled(places, wider, deeper):
        """With presses reported so much farther out, and with depths that are functions of depth, m, and of place (2,), m."""
        depths = rng.uniform(0.01, deepest, len(places))
        reported = [np.array([*place * wider, np.log(depth * deeper(place, depth)), 0, 0, 0, 0]) for place, depth in zip(places, depths)]
        found = [DomeFound(one[None], 1e-12 * np.eye(7), 0.5) for one in reported]
        count = len(places)
        presses = Presses((None,) * count, np.column_stack([places, np.zeros(count)]), depths, np.arange(count), np.zeros((count, 6)),
                          np.full(count, 0.025))
        return calibration._with_remaining_errors(known(), found, presses), reported, depths

    places = rng.uniform(-0.05, 0.05, (200, 2))
    found, reported, depths = scaled(places, 0.95, lambda place, depth: 1.1 - 0.2 * place @ place / farthest**2 - 0.02 * deepest / depth)
    assert found.wider == pytest.approx(0.95, abs=0.01)
    for one, place, depth in zip(reported, places, depths):
        assert np.exp(one[2]) / found.depth_scale(place, np.exp(one[2])) == pytest.approx(depth, rel=0.02)
    near, *_ = scaled(places[:6] * 1e-3, 0.5, lambda place, depth: 1.0)
    assert near.wider == pytest.approx(1.0, abs=0.02) and near.depth_scale(np.zeros(2), 0.02) == pytest.approx(1.0, abs=0.01)


@pytest.mark.full  # simulates a small library
@pytest.mark.parametrize('count, error', [(20, 3e-4), (5, 0.0)])
def test_the_error_of_shallow_depths_is_that_of_shallow_presses_and_none_of_too_few(count, error):
    depths, places = np.linspace(1e-3, 7e-3, count), np.zeros((count, 3))
    found = [DomeFound(press(0, 0, depth - 3e-4)[None], 1e-12 * np.eye(7), 0.5) for depth in depths]
    presses = Presses((None,) * count, places, depths, np.arange(count), np.zeros((count, 6)), np.full(count, 0.025))
    assert calibration._shallow_error(known(), found, presses) == pytest.approx(error, abs=1e-6)


def test_a_sheet_and_too_few_presses_are_refused():
    for presses, sensor in ((dome_presses(FEW, (0.012,)), MARKER_SENSORS['areal_single']), (dome_presses([(0, 0)], (0.01,)), DOME)):
        with pytest.raises(BadCalibration, match='needs a dome and 6 straight presses'):
            calibrate_dome(presses, sensor)


def test_the_radius_of_a_marker_is_that_on_the_dome():
    presses, points = dome_presses(FEW, (0.012,)), markers()
    camera_centres = np.tile(EYE, (len(points), 1))
    assert calibration._marker_radius(presses.fields[0], points, camera_centres, DOME) == pytest.approx(0.3 * max(DOME.pitch))
    larger = (DOME.plane_z - EYE[2]) / (points[:, 2] - EYE[2])  # in the viewing plane than on the dome
    presses.fields[0].area[:] = np.pi * (4.6e-3 * PX * larger)**2
    assert calibration._marker_radius(presses.fields[0], points, camera_centres, DOME) == pytest.approx(4.6e-3, rel=1e-3)


CAP, START = dome_cap(DOME), DomeNumbers(DomeMaterial(0.7, 70.0, 0.5), 0.025)


@pytest.mark.full  # simulates presses
def test_tension_gas_and_friction_are_reported_from_simulated_presses(monkeypatch):
    """Where the pressure is held, though sealed gas is likelier."""
    tension, gas, friction, across = 0.6, 0.0, 0.4, 0.05
    for name, value in {'LOAD_STEPS': 8, 'GASES': (1.0, 1e-4), 'TENSIONS': (1.0, 0.4), 'EVALUATIONS': 4, 'MeshPlan': lambda: MESH}.items():
        monkeypatch.setattr(calibration, name, value)  # coarse and few
    presses, true = dome_presses([(0.0, 0.0), (across, 0.0)], (0.012, 0.025), still=0), np.log([tension, max(gas, 1e-3), friction, 0.025])
    given = dict(points=POINTS, camera_centres=np.nan_to_num(EYES), cap=CAP, plane_z=DOME.plane_z, marker=0.004)
    for place in calibration._places(presses):  # what the true dome would have shown
        left = calibration._residuals((place, true), **given).reshape(place.shifts.shape) / place.weights[:, None, None]
        for depth, shift in zip(place.depths, place.shifts + left):
            presses.fields[np.flatnonzero(np.isclose(presses.depth, depth, atol=1e-6)
                                          & np.isclose(np.hypot(*presses.position[:, :2].T), place.across))[0]].shift[:] = shift
    found = identify_dome(presses, start=START, **given).logs
    assert np.exp(found[1]) < 0.1
    assert found[0] == pytest.approx(true[0], abs=0.2) and found[2] == pytest.approx(true[2], abs=0.2)


def test_presses_that_cannot_be_simulated_are_refused(monkeypatch):
    monkeypatch.setattr(mechanics, 'STEPS', 1)
    monkeypatch.setattr(calibration, 'LOAD_STEPS', 1)
    with pytest.raises(BadCalibration, match='do not converge'):
        identify_dome(dome_presses([(0.0, 0.0)], (0.012,), still=0), POINTS, np.nan_to_num(EYES), CAP, DOME.plane_z, 0.004, START)

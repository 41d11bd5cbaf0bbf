# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches at other noises and frame rates, and with other constants than those that are written: they degrade as the noise says."""
import numpy as np
import pytest
from dome_library import EYES, MATERIAL as RUBBER, library_field, press, small_library
from dome_scenes import DOME, NOISE, markers, seen
from sheet_scenes import EYE, GRID, MATERIAL, SENSOR, field_of, library
from tactile_perception.press import choice, estimator
from tactile_perception.press.dome import method as dome
from tactile_perception.press.dome.calibration import DomeCalibration
from tactile_perception.press.dome.fit import FieldNoise as DomeNoise
from tactile_perception.press.estimate import TouchEstimate
from tactile_perception.press.sheet import method as sheet
from tactile_perception.press.sheet.calibration import CameraShifts, SheetCalibration
from tactile_perception.press.sheet.fit import FieldNoise, show
from tactile_perception.press.sheet.library import Press

COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])
ON_SHEET = SheetCalibration(library(), MATERIAL, 1.2e-3, CameraShifts(EYE[:1], np.zeros((1, 2))), FieldNoise(5e-6, 5e-3, 3e-3, 1.5), 3e-5,
                            0.01, COVERED, 6e-3)


class OnSheet:
    """A sheet under random scenes: a press, a drag, or two presses."""

    def __init__(self):
        self.method = sheet.SheetModelMethod(ON_SHEET, SENSOR)

    def scene(self, number, noise):
        """Places (n, 2), m, of the tips, and the field."""
        rng = np.random.default_rng(number)
        places = rng.uniform(-1, 1, (1, 2)) * [0.015, 0.009] if number % 3 else np.array([[-0.009, 0.002], [0.009, -0.003]])
        drag = rng.uniform(-0.4, 0.4, 2) if number % 3 == 1 else (0.0, 0.0)
        shown = show(library(), [Press(place, rng.uniform(2e-3, 5e-3), 0.0, tuple(drag)) for place in places], GRID, EYE, 0.1)[0]
        return places, field_of(shown, 5e-6 * noise, 5e-3 * noise, number)

    def untouched(self, noise):
        return field_of(np.zeros((len(GRID), 3)), 5e-6 * noise, 5e-3 * noise)


class OnDome:
    """The same of a dome."""

    def __init__(self):
        calibration = DomeCalibration(small_library(), RUBBER, seen(markers()), EYES, DomeNoise(NOISE, 0.003, 0.002), 1e-4, 0.01, 0.0, 1.0,
                                      1.0, 1.0, 0.0, 0.035, 0.08, 1.0)
        self.method = dome.DomeModelMethod(calibration, DOME)

    def scene(self, number, noise):
        rng = np.random.default_rng(number)
        places = rng.uniform(-0.035, 0.035, (1, 2)) if number % 3 else np.array([[0.045, 0.02], [-0.04, -0.015]])
        drag = rng.uniform(-0.4, 0.4, 2) if number % 3 == 1 else np.zeros(2)
        depth = rng.uniform(0.012, 0.03)
        presses = [press(*place, depth, drag=drag) for place in places]
        return places + depth * drag, library_field(*presses, noise=NOISE * noise, seed=number)

    def untouched(self, noise):
        return library_field(noise=NOISE * noise)


def right(surface, noise=1.0):
    """Share of random scenes in which all touches are reported, and where they are, to three standard deviations."""
    on, reported = surface(), []
    for number in range(12):
        assert on.method.estimate(on.untouched(noise)) == [], 'nothing touches between the scenes'
        places, field = on.scene(number, noise)
        touches = sorted(on.method.estimate(field), key=lambda touch: touch.position[0])
        tips = [touch.position if touch.lowest is None else touch.lowest for touch in touches]
        off = [(tip[:2] - place, touch.covariance[:2, :2]) for tip, touch, place in zip(tips, touches, sorted(places.tolist()))]
        reported.append(len(touches) == len(places) and all(one @ np.linalg.solve(spread, one) < 18 for one, spread in off))
    return np.mean(reported)


CONSTANTS = [(choice, 'ALIKE'), *((sheet, name) for name in ('ORDINARY', 'STANDS_OUT', 'FLOOR_PLACE', 'DRAG_PLACE')),
             *((dome, name) for name in ('ORDINARY', 'STANDS_OUT', 'SURE', 'NOT_LINEAR'))]


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('times', [0.5, 2.0])
@pytest.mark.parametrize('module, name', CONSTANTS)
def test_half_and_double_of_a_constant_that_decides_change_little(monkeypatch, module, name, times):
    value = getattr(module, name)
    monkeypatch.setattr(module, name, tuple(times * part for part in value) if isinstance(value, tuple) else times * value)
    for surface in (OnSheet, OnDome) if module is choice else (OnSheet,) if module is sheet else (OnDome,):
        assert right(surface) > 0.9


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('surface', [OnSheet, OnDome])
@pytest.mark.parametrize('prior', ['STRAIGHT', 'TWO'])
def test_half_and_double_of_a_prior_change_little(monkeypatch, surface, prior):
    known = getattr(choice, prior)
    for times in (0.5, 2.0):
        monkeypatch.setattr(choice, prior, known._replace(prior=known.prior + np.log(times)))
        assert right(surface) > 0.9


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('surface', [OnSheet, OnDome])
def test_three_times_the_noise_is_reported_in_the_errors(surface):
    assert right(surface, 3.0) > 0.8


@pytest.mark.parametrize('rate', [15.0, 30.0, 60.0])
@pytest.mark.parametrize('name, times', [('ACCELERATION', 1.0), *((name, times) for name in ('ACCELERATION', '_GATE', '_SPEED')
                                                                  for times in (0.5, 2.0))])
def test_touches_keep_their_numbers_and_their_accuracy_at_half_and_double_the_rate(monkeypatch, rate, name, times):
    monkeypatch.setattr(estimator, name, times * getattr(estimator, name))
    tracker, rng, off = estimator.TouchTracker(), np.random.default_rng(0), []
    for k in range(int(2 * rate)):
        way = 0.02 * (1 - np.cos(2 * k / rate))  # m, there and back at up to 0.04 m/s
        places = [np.array([way, 0.0, -2e-3]), np.array([0.02, 0.02 - way / 2, -2e-3])]
        noisy = [place + 1e-4 * rng.standard_normal(3) for place in places]
        found = tracker.process([TouchEstimate(place, -place[2], 1e-8 * np.eye(3), 1e-4) for place in noisy], 1 + k / rate)
        assert [touch.id for touch in found] == [1, 2]
        off += [touch.estimate.position[:2] - place[:2] for touch, place in zip(found, places)]
    assert np.sqrt(np.mean(np.square(off))) < 1.1e-4

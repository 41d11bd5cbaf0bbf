# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts with other noises, frame rates and constants: errors grow as the noise does."""
from dataclasses import replace

import numpy as np
import pytest
from dome_library import EYES, library_field, press, small_library
from dome_scenes import DOME, NOISE, markers, seen
from sheet_scenes import EYE, GRID, SENSOR, field_of, library

from tactile_perception.press import estimate as choice
from tactile_perception.press.dome import model as dome
from tactile_perception.press.sheet import model as sheet
from tactile_perception.press.sheet.library import Press

COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])
ON_SHEET = sheet.SheetCalibration(library(), 1.2e-3, sheet.CameraShifts(EYE[:1], np.zeros((1, 2))),
                                  sheet.FieldNoise(5e-6, 5e-3, 3e-3, 1.5), 3e-5, 0.01, COVERED, 6e-3)


class OnSheet:
    """A sheet in random scenes: a press, a drag, or two presses."""

    def __init__(self):
        self.method = sheet.SheetModelMethod(ON_SHEET, SENSOR)

    def scene(self, number, noise):
        """Positions (n, 2), m, of the tips, and the field."""
        rng = np.random.default_rng(number)
        positions = rng.uniform(-1, 1, (1, 2)) * [0.015, 0.009] if number % 3 else np.array([[-0.009, 0.002], [0.009, -0.003]])
        drag = rng.uniform(-0.4, 0.4, 2) if number % 3 == 1 else (0.0, 0.0)
        pressed = [Press(position, rng.uniform(2e-3, 5e-3), 0.0, tuple(drag)) for position in positions]
        shown = sheet.show(library(), pressed, GRID, EYE, 0.1)[0]
        return positions, field_of(shown, 5e-6 * noise, 5e-3 * noise, number)

    def untouched(self, noise):
        return field_of(np.zeros((len(GRID), 3)), 5e-6 * noise, 5e-3 * noise)


class OnDome:
    """A dome in random scenes."""

    def __init__(self):
        calibration = dome.DomeCalibration(small_library(), seen(markers()), EYES, dome.FieldNoise(NOISE, 0.003, 0.002), 1e-4, 0.01,
                                           1.0, 1.0, 1.0, 0.0, 0.035, 0.08, 1.0)
        self.method = dome.DomeModelMethod(calibration, DOME)

    def scene(self, number, noise):
        rng = np.random.default_rng(number)
        positions = rng.uniform(-0.035, 0.035, (1, 2)) if number % 3 else np.array([[0.045, 0.02], [-0.04, -0.015]])
        drag = rng.uniform(-0.4, 0.4, 2) if number % 3 == 1 else np.zeros(2)
        depth = rng.uniform(0.012, 0.03)
        presses = [press(*position, depth, drag=drag) for position in positions]
        return positions + depth * drag, library_field(*presses, noise=NOISE * noise, seed=number)

    def untouched(self, noise):
        return library_field(noise=NOISE * noise)


def right(surface, noise=1.0):
    """Share of random scenes in which all contacts are reported within three standard deviations."""
    on, reported = surface(), []
    for number in range(12):
        assert on.method.estimate(on.untouched(noise)) == [], 'nothing touches between the scenes'
        positions, field = on.scene(number, noise)
        touches = sorted(on.method.estimate(field), key=lambda touch: touch.position[0])
        tips = [touch.position if touch.lowest is None else touch.lowest for touch in touches]
        off = [(tip[:2] - position, touch.covariance[:2, :2]) for tip, touch, position in zip(tips, touches, sorted(positions.tolist()))]
        reported.append(len(touches) == len(positions) and all(one @ np.linalg.solve(spread, one) < 18 for one, spread in off))
    return np.mean(reported)


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('surface, room', [(OnSheet, sheet), (OnDome, dome)])
def test_results_hold_with_halved_and_doubled_constants(monkeypatch, surface, room, seed):
    """All constants change at once, each by a factor between 0.5 and 2."""
    def other(value):
        return tuple(map(other, value)) if isinstance(value, tuple) else value * 2**draw.uniform(-1, 1)

    draw = np.random.default_rng(seed)
    monkeypatch.setattr(room, 'CONSTANTS', replace(room.CONSTANTS, **{one: other(value) for one, value in vars(room.CONSTANTS).items()}))
    monkeypatch.setattr(choice, 'VALUES_PER_ERROR', other(choice.VALUES_PER_ERROR))
    for name in ('STRAIGHT', 'TWO'):
        known = getattr(choice, name)
        monkeypatch.setattr(choice, name, known._replace(prior=known.prior + np.log(other(1.0))))
    assert right(surface) > 0.8


@pytest.mark.full  # simulates a small dome
@pytest.mark.parametrize('surface', [OnSheet, OnDome])
def test_errors_grow_with_three_times_the_noise(surface):
    assert right(surface, 3.0) > 0.8

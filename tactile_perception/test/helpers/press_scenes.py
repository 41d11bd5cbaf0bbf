# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Random scenes of presses on a sheet and on a dome: a press, a drag, or two presses, with the untouched field before each."""
from dataclasses import replace

import numpy as np
from dome_library import EYES, library_field, press, small_library
from dome_scenes import DOME, NOISE, markers, seen
from sheet_scenes import EYE, GRID, MATERIAL, SENSOR, field_of, library, pressed as shown_by

from tactile_perception.press.dome import model as dome
from tactile_perception.press.sheet import model as sheet
from tactile_perception.press.sheet.library import Press

COVERED = np.array([[-0.018, -0.011], [0.018, 0.011]])
ON_SHEET = sheet.SheetCalibration(library(), 1.2e-3, sheet.CameraShifts(EYE[:1], np.zeros((1, 2))),
                                  sheet.FieldNoise(5e-6, 5e-3, 3e-3, 1.5), 3e-5, 0.01, COVERED, 6e-3)


class OnSheet:
    """A sheet in random scenes: a press, a drag, or two presses."""

    noises = 5e-6, 5e-3  # m and 1, of shift and growth

    def __init__(self):
        self.method = sheet.SheetModelMethod(ON_SHEET, SENSOR)

    def scene(self, number, noise):
        """Positions (n, 2) and depths (n,), m, of the tips, and the field."""
        rng = np.random.default_rng(number)
        positions = rng.uniform(-1, 1, (1, 2)) * [0.015, 0.009] if number % 3 else np.array([[-0.009, 0.002], [0.009, -0.003]])
        drag = rng.uniform(-0.4, 0.4, 2) if number % 3 == 1 else (0.0, 0.0)
        pressed = [Press(position, rng.uniform(2e-3, 5e-3), 0.0, tuple(drag)) for position in positions]
        return self._shown(pressed, noise, number)

    def _shown(self, pressed, noise, number):
        field = field_of(sheet.show(library(), pressed, GRID, EYE, 0.1)[0], *np.multiply(self.noises, noise), number)
        return np.array([one.position for one in pressed]), np.array([one.depth for one in pressed]), field

    def untouched(self, noise):
        return field_of(np.zeros((len(GRID), 3)), *np.multiply(self.noises, noise))


class OnSheetOfOtherTips(OnSheet):
    """Presses as faint as 0.2 mm, by other tips than in calibration: each third simulated with another friction, on another mesh."""

    def scene(self, number, noise):
        """Positions (n, 2) and depths (n,), m, of the tips, and the field."""
        rng = np.random.default_rng([number, 1])
        position, depth = rng.uniform(-1, 1, 2) * [0.014, 0.008], float(np.exp(rng.uniform(*np.log([2e-4, 5e-3]))))
        if number % 3 == 0:
            material = replace(MATERIAL, friction=float(rng.uniform(0.3, 1.0)))
            field = field_of(shown_by(*position.tolist(), depth, 7e-3 * float(rng.uniform(0.8, 1.25)), material),
                             *np.multiply(self.noises, noise), number)
            return position[None], np.array([depth]), field
        presses = [Press(position, depth, rng.uniform(-0.2, 0.2), tuple(rng.uniform(-0.6, 0.6, 2) * (number % 3 == 1)))]
        if number % 3 == 2:
            presses.append(Press(-position - [0.004, 0.0], rng.uniform(1e-3, 4e-3), rng.uniform(-0.2, 0.2)))
        return self._shown(presses, noise, number)


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
        return positions + depth * drag, np.full(len(positions), depth), library_field(*presses, noise=NOISE * noise, seed=number)

    def untouched(self, noise):
        return library_field(noise=NOISE * noise)


class OnDomeOfOtherTips(OnDome):
    """Presses as faint as 1 mm, by other tips and with other frictions than in calibration."""

    def scene(self, number, noise):
        """Positions (n, 2) and depths (n,), m, of the tips, and the field."""
        rng = np.random.default_rng([number, 2])
        first, drag = rng.uniform(-0.045, 0.045, 2), rng.uniform(-0.5, 0.5, 2) * (number % 3 == 1)
        positions = np.array([first, -first - [0.02, 0.0]])[:1 + (number % 3 == 2)]
        depths = np.exp(rng.uniform(*np.log([1e-3, 0.03]), len(positions)))
        presses = [press(*position, depth, rng.uniform(-0.6, 0.4), rng.uniform(-0.8, 0.0), drag)
                   for position, depth in zip(positions, depths)]
        return positions + depths[:, None] * drag, depths, library_field(*presses, noise=NOISE * noise, seed=number)


def results(surface, noise=1.0, scenes=12):
    """Whether each random scene shows as many contacts as are there, and position errors (n, 2), depth errors (n,), m, and chi-squares (n,)
    of two numbers, of the contacts of those scenes. Nothing may touch between the scenes."""
    counted, errors = [], []
    for number in range(scenes):
        false = surface.method.estimate(surface.untouched(noise))
        positions, depths, field = surface.scene(number, noise)
        touches = sorted(surface.method.estimate(field), key=lambda touch: touch.position[0])
        counted.append(not false and len(touches) == len(positions))
        for touch, k in zip(touches, np.argsort(positions[:, 0])) if counted[-1] else ():
            error, spread = (touch.position if touch.lowest is None else touch.lowest)[:2] - positions[k], touch.covariance[:2, :2]
            errors.append([*error, touch.depth - depths[k], error @ np.linalg.solve(spread, error)])
    errors = np.array(errors).reshape(-1, 4)
    return np.array(counted), errors[:, :2], errors[:, 2], errors[:, 3]

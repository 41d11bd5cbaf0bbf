# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses
import functools

import numpy as np
import pytest
from sheet_scenes import EYE, GRID, field_of, library, pressed
from tactile_perception.press.sheet.model import FieldNoise, Seen, SheetInverse, SheetStart, show
from tactile_perception.press.sheet.library import Press

NOISE = FieldNoise(5e-6, 5e-3, 3e-3, 1.5)


@functools.cache
def common_inverse():
    return SheetInverse(library(), NOISE, 1.2e-3, 4.5e-3)


def test_covariance_is_that_of_many_trials():
    """In a world that is the library's own, noise alone scatters the estimate, as much as is said."""
    inverse, press = SheetInverse(library(), FieldNoise(1e-5, 5e-3, 1e-6, 1e-4), 0.0, 4.5e-3), Press(np.array([0.008, 0.004]), 3e-3)
    field = field_of(np.zeros((117, 3)))
    clean, _ = show(library(), [press], field.rest, field.camera_centre)
    errors, inverses = [], []
    for seed in range(150):
        found = inverse.solve(Seen(field_of(clean, 1e-5, 5e-3, seed)), [press])
        errors.append(found.presses[0].vector - press.vector)
        inverses.append(np.linalg.inv(found.covariance[:3, :3]))
    squares = [error[:3] @ inverse @ error[:3] / 3 for error, inverse in zip(errors, inverses)]
    assert 0.7 < np.mean(squares) < 1.3


def test_a_drag_is_reported_with_the_force_that_it_takes():
    press = Press(np.array([0.005, -0.003]), 4e-3, drag=(0.4, -0.2))
    clean, _ = show(library(), [press], GRID, EYE)
    found = SheetInverse(library(), NOISE, 0.0, 4.5e-3).solve(Seen(field_of(clean, 2e-6, 1e-3)), [Press(press.place, 3e-3)], drags=True)
    straight = common_inverse().solve(Seen(field_of(show(library(), [Press(press.place, 4e-3)], GRID, EYE)[0])), [Press(press.place, 3e-3)])
    assert found.presses[0].drag == pytest.approx(press.drag, abs=0.03)
    assert found.wrenches[0, 1:3] - straight.wrenches[0, 1:3] == pytest.approx(found.presses[0].drag, abs=0.02)


STILL, GROWTH = 1e-5, 5e-3


def test_markers_out_of_sight_are_left_out():
    field = field_of(pressed(0.012, -0.007, 4e-3), STILL, GROWTH)
    hidden = np.random.default_rng(0).random(len(GRID)) < 0.3
    blank = {name: np.where(hidden.reshape((-1,) + (1,) * (value.ndim - 1)), np.nan, value)
             for name, value in vars(field).items()}
    start = SheetStart(library(), STILL, GROWTH)
    start.best(field)
    press, _ = start.best(dataclasses.replace(field, **blank))
    assert np.hypot(*(press.place - [0.012, -0.007])) < 4e-3


def test_noise_louder_than_was_calibrated_does_not_stand_out():
    """Nor does it hide a press."""
    start, still = SheetStart(library(), STILL, GROWTH), np.zeros((len(GRID), 3))
    scores = [start.best(field_of(still, 3e-5, 2e-2, seed))[1] for seed in range(300)]
    assert max(scores) < 6 < 30 < start.best(field_of(pressed(0.006, -0.004, 3e-3), 3e-5, 2e-2))[1]

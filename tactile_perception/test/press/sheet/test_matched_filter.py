# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import dataclasses

import numpy as np
import pytest
from tactile_perception.press.sheet.matched_filter import SheetStart

from sheet_scenes import GRID, field_of, library, pressed

NOISE, GROWTH = 1e-5, 5e-3


@pytest.mark.parametrize('place, depth', [((0.0, 0.0), 4e-3), ((0.012, -0.007), 2e-3), ((-0.015, 0.01), 6e-3)])
def test_the_best_match_is_near(place, depth):
    press, score = SheetStart(library(), NOISE, GROWTH).best(field_of(pressed(*place, depth), NOISE, GROWTH))
    assert np.hypot(*(press.place - place)) < 4e-3 and press.depth == pytest.approx(depth, rel=0.3) and score > 30


def test_markers_out_of_sight_are_left_out():
    field = field_of(pressed(0.012, -0.007, 4e-3), NOISE, GROWTH)
    hidden = np.random.default_rng(0).random(len(GRID)) < 0.3
    blank = {name: np.where(hidden.reshape((-1,) + (1,) * (value.ndim - 1)), np.nan, value)
             for name, value in vars(field).items()}
    start = SheetStart(library(), NOISE, GROWTH)
    start.best(field)
    press, _ = start.best(dataclasses.replace(field, **blank))
    assert np.hypot(*(press.place - [0.012, -0.007])) < 4e-3


def test_noise_does_not_stand_out():
    start, still = SheetStart(library(), NOISE, GROWTH), np.zeros((len(GRID), 3))
    assert max(start.best(field_of(still, NOISE, GROWTH, seed))[1] for seed in range(500)) < 6


def test_noise_louder_than_was_calibrated_does_not_stand_out():
    """Nor does it hide a press."""
    start, still = SheetStart(library(), NOISE, GROWTH), np.zeros((len(GRID), 3))
    scores = [start.best(field_of(still, 3e-5, 2e-2, seed))[1] for seed in range(300)]
    assert max(scores) < 6 < 30 < start.best(field_of(pressed(0.006, -0.004, 3e-3), 3e-5, 2e-2))[1]


@pytest.mark.parametrize('place', [(0.0011, -0.0007), (0.0093, 0.0052)])
def test_between_the_places_of_the_list_the_match_is_nearer_than_to_either(place):
    press, _ = SheetStart(library(), NOISE, GROWTH).best(field_of(pressed(*place, 3e-3), NOISE, GROWTH))
    assert np.hypot(*(press.place - place)) < 1e-3

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from tactile_perception.markers.mechanics.projection import (
    Press, appearance, appearance_slopes, disc_appearance, disc_points, fields_of, read_derivatives, read_press)

from sheet_scenes import EYE, GRID, library

PRESS = Press(np.array([0.011, -0.006]), 4e-3, 0.08)


def moved(k, step):
    vector = PRESS.vector
    vector[k] += step
    return read_press(library(), Press(vector[:2], vector[2], vector[3], vector[4:]), GRID)


STEP = 3e-5  # m: presses are looked up to a nanometre


@pytest.mark.parametrize('k, step', [(0, STEP), (1, STEP), (2, STEP), (3, 3e-3), (4, STEP), (5, STEP)])
def test_derivatives_are_differences(k, step):
    expected = (moved(k, step) - moved(k, -step)) / (2 * step)
    assert read_derivatives(library(), PRESS, GRID)[..., 1 + k] == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_derivatives_of_a_drag_are_differences():
    press = Press(PRESS.place, PRESS.depth, PRESS.log_radius, (1e-3, -5e-4))
    read = read_derivatives(library(), press, GRID)
    assert read[..., 0] == pytest.approx(read_press(library(), press, GRID), abs=1e-12)
    after, before = (read_press(library(), Press(press.place + [step, 0], press.depth, press.log_radius, press.dragged), GRID)
                     for step in (STEP, -STEP))
    expected = (after - before) / (2 * STEP)
    assert read[..., 1] == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_fields_that_are_known_need_not_be_looked_up(monkeypatch):
    fields, read = fields_of(library(), PRESS), read_press(library(), PRESS, GRID)
    monkeypatch.setattr(type(library()), 'fields', None)
    assert read_press(library(), PRESS, GRID, fields) == pytest.approx(read)
    assert read_derivatives(library(), PRESS, GRID, fields)[..., 0] == pytest.approx(read)


def test_slopes_are_differences():
    whole, h = read_press(library(), PRESS, GRID), 1e-7
    for axis in (0, 1):
        step = h * np.eye(2)[axis]
        slope = (read_press(library(), PRESS, GRID + step)[:, 0] - read_press(library(), PRESS, GRID - step)[:, 0]) / (2 * h)
        assert slope == pytest.approx(whole[:, 1 + axis], abs=1e-6)


def test_a_sheet_that_comes_nearer_as_a_whole_looks_larger():
    deformed = np.zeros((len(GRID), 3, 3))
    deformed[:, 0, 2] = -0.002
    seen = appearance(deformed, GRID, EYE)
    assert seen[:, :2] == pytest.approx(GRID * (0.062 / 0.060 - 1)) and seen[:, 2] == pytest.approx(2 * np.log(0.062 / 0.060))


def test_appearances_tell_their_slopes():
    whole, rng = read_press(library(), PRESS, GRID), np.random.default_rng(0)
    way = rng.normal(0, 1, whole.shape) * np.array([1e-3, 0.1, 0.1])[:, None]
    step = 1e-4
    expected = (appearance(whole + step * way, GRID, EYE) - appearance(whole - step * way, GRID, EYE)) / (2 * step)
    found = np.einsum('kap,kp->ka', appearance_slopes(whole, GRID, EYE), way.reshape(-1, 9))
    assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_a_disc_is_the_mean_over_its_points():
    """Against a thousand points of each disc."""
    radius, count = 1.2e-3, np.arange(1000) + 0.5
    near = np.argsort(np.hypot(*(GRID - PRESS.place).T))[:12]
    rest, eye = GRID[near], EYE[near]
    seen = disc_appearance(read_press(library(), PRESS, disc_points(rest, radius)), rest, eye, radius)
    angle, out = count * np.pi * (3 - np.sqrt(5)), radius * np.sqrt(count / 1000)  # a sunflower's
    cloud = np.stack([out * np.cos(angle), out * np.sin(angle)], axis=1)
    points = (rest[:, None] + cloud).reshape(-1, 2)
    each = appearance(read_press(library(), PRESS, points), points, np.repeat(eye, 1000, axis=0))
    area, places = np.exp(each[:, 2]).reshape(12, 1000), (each[:, :2] + points).reshape(12, 1000, 2)
    centroid = (places * area[..., None]).sum(1) / area.sum(1)[:, None] - rest
    assert np.abs(seen[:, :2] - centroid).max() < 1e-5 and np.abs(seen[:, 2] - np.log(area.mean(1))).max() < 0.02

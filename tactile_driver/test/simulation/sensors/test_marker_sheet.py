# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.sensors.marker_sheet import drags, grid, markers, presses, scattered
from tactile_driver.simulation.skin.sheet import Sheet


def test_markers_stand_on_a_grid_a_bit_off_in_place_and_size():
    sheet = Sheet(0.06, 0.045, 40.0, 1.3, 1e-4, 65)
    pattern = markers(sheet, 9, 13, (0.0045, 0.0045), 0.0012, np.random.default_rng(3))
    assert (pattern.rows, pattern.columns) == (9, 13) and pattern.numbers.tolist() == list(range(117))
    places = pattern.sampler.places(sheet.rest)
    u, v = np.meshgrid(np.arange(13) - 6, np.arange(9) - 4)
    off = places[:, :2] - 0.0045 * np.stack([u.ravel(), v.ravel()], axis=1)
    assert 0.03e-3 < (off - off.mean(axis=0)).std() < 0.12e-3 and np.abs(places[:, 2]).max() < 1e-12
    assert pattern.radius.mean() == pytest.approx(0.0012, rel=0.02) and 0.02 < pattern.radius.std() / 0.0012 < 0.05


def test_presses_keep_off_the_border_and_reach_all_depths():
    half = (0.030, 0.0225)
    acts = presses('ball_6mm', grid((0.024, 0.0165), 7, 5), half, 0.013, 3, np.random.default_rng(1))
    keys = [play(start=1.0)[1] for play in acts]
    assert len(keys) == 35
    for path in keys:
        margin = min(half[0] - abs(path[0].x), half[1] - abs(path[0].y))
        assert max(key.press for key in path) <= 0.85 * margin + 1e-12
    depths = np.array([key.press for path in keys for key in path if key.press > 0])
    assert depths.max() > 0.012 and depths.min() < 0.0015


def test_drags_and_scattered_places_stay_on_the_sheet():
    rng = np.random.default_rng(0)
    half = np.array([0.030, 0.0225])
    for play in drags('ball_6mm', 20, half, (0.003, 0.009), 0.009, rng):
        for key in play(start=0.0)[1]:
            assert (np.abs([key.x, key.y]) < half - 0.005).all() and key.press <= 0.009
    assert (np.abs(scattered((0.02, 0.01), 50, rng)) <= [0.02, 0.01]).all()

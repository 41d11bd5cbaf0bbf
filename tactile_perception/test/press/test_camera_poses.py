# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras are found from exact and from noisy image places; the markers that both see tie them together."""

import cv2
import numpy as np
import pytest
from tactile_perception.press.camera_poses import SideMarkers, fit_sides
from tactile_perception.errors import BadCalibration

from sheet_pair import DISTORTION, MATRIX, SENSOR, SIZE, pose, printed

GRID = SENSOR.grid()
COLUMN = np.arange(len(GRID)) % SENSOR.columns


def seen(side, places, known=True, noise=0.0, seed=0):
    """What a camera sees of five columns, its own side's."""
    rotation, eye = pose(side)
    id = np.flatnonzero(COLUMN < 5 if side == 'left' else COLUMN > 2)
    points = np.column_stack([places[id], np.zeros(len(id))])
    uv = cv2.projectPoints(points, rotation, -rotation @ eye, MATRIX, DISTORTION)[0].reshape(-1, 2)
    return SideMarkers(SIZE, id, uv + np.random.default_rng(seed).normal(0, noise, uv.shape), (MATRIX, DISTORTION) if known else None)


def test_exact_markers_give_exact_poses():
    sides = fit_sides([seen('left', GRID), seen('right', GRID)], GRID)
    for side, name in zip(sides, ('left', 'right')):
        np.testing.assert_allclose(side.eye, pose(name)[1], atol=1e-7)
        np.testing.assert_allclose(side.place(seen(name, GRID).uv), GRID[seen(name, GRID).id], atol=1e-8)


def test_an_irregular_print_is_averaged_and_both_views_agree():
    places = printed()
    found = [seen('left', places, noise=0.03), seen('right', places, noise=0.03, seed=1)]
    sides = fit_sides(found, GRID)
    off = np.concatenate([side.place(m.uv) - places[m.id] for side, m in zip(sides, found)])
    assert np.linalg.norm(off, axis=1).mean() < 0.035e-3
    _, left, right = np.intersect1d(found[0].id, found[1].id, return_indices=True)
    assert np.abs(sides[0].place(found[0].uv[left]) - sides[1].place(found[1].uv[right])).max() < 0.03e-3


def test_an_unknown_lens_is_found_as_far_as_the_markers_show_it():
    found = [seen('left', GRID, known=False), seen('right', GRID, known=False)]
    sides = fit_sides(found, GRID)
    assert max(np.abs(side.place(m.uv) - GRID[m.id]).max() for side, m in zip(sides, found)) < 0.02e-3
    assert all(np.isnan(side.eye).all() and side.distortion[0] < 0 for side in sides)


def test_too_few_markers_and_markers_that_form_no_grid_are_refused():
    left, right = seen('left', GRID), seen('right', GRID)
    with pytest.raises(BadCalibration, match='5 markers'):
        fit_sides([SideMarkers(SIZE, left.id[:5], left.uv[:5], left.camera), right], GRID)
    shuffled = np.random.default_rng(0).permutation(left.uv)
    with pytest.raises(BadCalibration, match='grid'):
        fit_sides([SideMarkers(SIZE, left.id, shuffled, left.camera), right], GRID)

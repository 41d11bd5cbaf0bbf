# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels taxel_edges and taxel_register (src/taxel/taxel_registration.cpp) against NumPy and SciPy."""
import numpy as np
import pytest
from scipy import ndimage
from tactile_perception._core import taxel_edges, taxel_register

SPLINE, SLOPE = np.array([1, 4, 1]) / 6, np.array([-0.5, 0, 0.5])


def face(row=20.3, column=21.6, turn=0.2, grown=0.0):
    """Score (44, 44) float32 of an oblong face."""
    y, x = np.mgrid[:44, :44].astype(float)
    along = np.cos(turn) * (x - column) + np.sin(turn) * (y - row)
    across = np.cos(turn) * (y - row) - np.sin(turn) * (x - column)
    sides = [1 / (1 + np.exp(-2.5 * (half + grown - np.abs(part)))) for half, part in ((9, along), (5, across))]
    return (sides[0] * sides[1]).astype(np.float32)


def edges(image):
    """Edges with the arguments that are used on an array of 44 x 44."""
    return taxel_edges(image, scale=1.0, steep=0.08, rim=2, most=250)


def moved(image, at, fit):
    """Places (M, 2) row and column of the edges after a motion fit (4,)."""
    place, _, _, _, middle, reach, _ = at
    turn = fit[2] / reach
    y, x = (place - middle).T
    return middle + np.stack([np.cos(turn) * y + np.sin(turn) * x + fit[1], np.cos(turn) * x - np.sin(turn) * y + fit[0]], axis=1)


def test_edges_are_where_the_slope_is_steep():
    image = face()
    across = ndimage.correlate1d(ndimage.correlate1d(image.astype(float), SLOPE, 1), SPLINE, 0)
    down = ndimage.correlate1d(ndimage.correlate1d(image.astype(float), SLOPE, 0), SPLINE, 1)
    value = ndimage.correlate1d(ndimage.correlate1d(image.astype(float), SPLINE, 0), SPLINE, 1)
    steep = np.hypot(across, down)
    row, column = np.nonzero(steep > 0.08)
    place, values, slopes, normal, middle, reach, count = edges(image)
    assert count == len(row) and middle == pytest.approx([row.mean(), column.mean()])
    step = -(-count // 250)
    kept = (row + column) % step == 0
    row, column = row[kept], column[kept]
    assert (place == np.stack([row, column], axis=1)).all() and values == pytest.approx(value[row, column], abs=1e-6)
    expected = [across[row, column], down[row, column],
                ((column - middle[1]) * down[row, column] - (row - middle[0]) * across[row, column]) / reach, -steep[row, column]]
    assert slopes == pytest.approx(np.stack(expected, axis=1), abs=1e-6)
    if step == 1:
        assert normal == pytest.approx(slopes.T @ slopes)


@pytest.mark.parametrize('turns', [True, False])
def test_a_step_is_that_of_weighted_least_squares(turns):
    first, then = face(), face(20.32, 21.58)
    place, value, slopes, _, middle, reach, _ = at = edges(first)
    left = value - ndimage.map_coordinates(then, moved(first, at, np.zeros(4)).T, float, order=3, mode='nearest', prefilter=False)
    spread = max(1.4826 * np.sort(np.abs(left))[len(left) // 2], 0.015)
    root = np.maximum(1 - (left / (4.685 * spread))**2, 0)
    used = [0, 1, 2, 3] if turns else [0, 1, 3]
    step = np.linalg.lstsq(slopes[:, used] * root[:, None], left * root, rcond=None)[0]
    assert np.abs(step).max() < 0.04  # so that one step is all
    fit, found, inliers = taxel_register(then, place, value, slopes, middle, reach, scale=1.0, turns=turns, guess=np.zeros(4))
    assert fit[used] == pytest.approx(step, abs=1e-6) and found == pytest.approx(spread)
    assert inliers == pytest.approx((np.abs(left) < 4.685 * spread).mean())


@pytest.mark.parametrize('motion', [(0.4, -0.3, 0.03, 0.0), (-1.2, 0.8, -0.05, 0.2), (0.0, 0.0, 0.0, 0.0)])
def test_a_motion_is_found(motion):
    row, column, turn, grown = motion
    first = face()
    place, value, slopes, _, middle, reach, _ = edges(first)
    fit, spread, inliers = taxel_register(face(20.3 + row, 21.6 + column, 0.2 + turn, grown), place, value, slopes, middle, reach,
                                          scale=1.0, turns=True, guess=np.zeros(4))
    about = middle - [20.3, 21.6]  # the face turns about its own middle
    expected = np.array([column, row]) + turn * np.array([-about[0], about[1]])
    assert fit[:2] == pytest.approx(expected, abs=0.03) and fit[2] / reach == pytest.approx(turn, abs=0.004)
    assert fit[3] == pytest.approx(grown, abs=0.05) and inliers > 0.9


def test_nothing_has_no_edges_and_a_guess_without_a_number_stays_one():
    assert edges(np.zeros((44, 44), np.float32))[6] == 0 and edges(np.zeros((0, 5), np.float32))[6] == 0
    place, value, slopes, _, middle, reach, _ = edges(face())
    fit, _, inliers = taxel_register(face(), place, value, slopes, middle, reach, scale=1.0, turns=True, guess=np.full(4, np.nan))
    assert np.isnan(fit).any() and inliers == 0


def test_the_image_is_positive_pressure_times_scale():
    first, then = face(), face(20.5, 21.4)
    pressure, later = (np.where(image < 0.01, -5e3, 3e4 * image).astype(np.float32) for image in (first, then))
    shown, seen = (np.maximum(p, 0) * np.float32(1 / 3e4) for p in (pressure, later))
    for one, other in zip(taxel_edges(pressure, scale=1 / 3e4, steep=0.08, rim=2, most=250), edges(shown)):
        np.testing.assert_array_equal(one, other)
    at = edges(shown)
    rule = {'turns': True, 'guess': np.zeros(4)}
    for one, other in zip(taxel_register(later, *at[:3], *at[4:6], scale=1 / 3e4, **rule),
                          taxel_register(seen, *at[:3], *at[4:6], scale=1.0, **rule)):
        np.testing.assert_array_equal(one, other)

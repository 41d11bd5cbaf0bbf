# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The class DotFinder (src/dots/finder.cpp, disc.cpp) on discs drawn sample by sample."""
from dataclasses import replace

import cv2
import numpy as np
import pytest
from tactile_perception._core.dots import DotFinder
from tactile_perception.dots.fit import DiscModel, Look

FINE, GROUND, CONTRAST, BLUR = 8, 180.0, -120.0, 0.9
MODEL = DiscModel(4.0, 10.0, BLUR)


def drawn(uv, diameters, shape=(120, 160)):
    """(rows, columns) float64: dots on even ground, area-sampled and blurred at eight times the resolution."""
    y, x = ((np.arange(length * FINE) + 0.5) / FINE - 0.5 for length in shape)
    inside = np.zeros((len(y), len(x)), np.float32)
    for (u, v), d in zip(uv, diameters):
        near = np.ix_(np.abs(y - v) < d, np.abs(x - u) < d)
        disc = np.clip((d / 2 - np.hypot(x[near[1][0]] - u, y[near[0]] - v)) * FINE + 0.5, 0, 1)
        inside[near] = np.maximum(inside[near], disc)
    fine = cv2.GaussianBlur(inside, (0, 0), BLUR * FINE)
    return GROUND + CONTRAST * cv2.resize(fine, shape[::-1], interpolation=cv2.INTER_AREA).astype(float)


def printed(rng, rows=6, columns=8):
    """Places (N, 2) px of a grid off the pixel raster at a pitch of 18 px, and diameters (N,) of 5 to 9 px."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    uv = np.stack([15 + 18.3 * column, 14 + 18.1 * row], 1) + rng.uniform(-0.5, 0.5, (rows * columns, 2))
    return uv, rng.uniform(5, 9, rows * columns)


LOOK = Look('grey', 1, 4.0, 7.0, 10.0, BLUR, CONTRAST, GROUND, 2.0)


def find(image, before=None):
    """Dots (N, 4) of an image (H, W) of any type, rounded: u, v, area, sigma; and whether some outgrow the model. before: an image that
    tells how much dots differ from discs."""
    finder = DotFinder(MODEL, LOOK)
    for one in (before, image):
        if one is not None:
            found = finder.find(np.clip(np.rint(one), 0, 255).astype(np.uint8))
    return np.column_stack([found.uv, found.area, found.sigma]), found.outgrown


def nearest(found, uv):
    """For each place (N, 2), the nearest dot of found (M, 4), and its distance."""
    distance = np.hypot(*(uv[:, None] - found[:, :2]).transpose(2, 0, 1))
    return found[distance.argmin(1)], distance.min(1)


def test_places_and_sizes_without_noise():
    uv, diameter = printed(np.random.default_rng(5))
    dots, distance = nearest(find(drawn(uv, diameter))[0], uv)
    assert np.sqrt((distance**2).mean()) < 0.006
    assert np.abs(np.sqrt(4 / np.pi * dots[:, 2]) - diameter).max() < 0.06


def test_sigma_is_the_spread_of_positions():
    uv, diameter = printed(np.random.default_rng(7))
    image, rng, errors = drawn(uv, diameter), np.random.default_rng(8), []
    for _ in range(30):
        dots, _ = nearest(find(image + rng.normal(0, 4, image.shape))[0], uv)
        errors.append((dots[:, :2] - uv) / dots[:, 3:])
    # errors over a standard deviation of 22 degrees of freedom: Student's distribution, whose variance is 22 / 20
    assert np.mean(np.square(errors)) == pytest.approx(1.1, abs=0.1)


def test_touching_dots_are_separated():
    rng = np.random.default_rng(9)
    uv, diameter = printed(rng)
    for first, second in ((9, 10), (20, 28)):
        step = uv[second] - uv[first]
        uv[second] = uv[first] + step / np.hypot(*step) * (diameter[first] + diameter[second]) / 2
    found, _ = find(drawn(uv, diameter) + rng.normal(0, 2, (120, 160)))
    assert len(found) == len(uv)
    assert nearest(found, uv)[1].max() < 0.08


def test_sloping_light_moves_no_dot():
    uv, diameter = printed(np.random.default_rng(10))
    found, _ = find(drawn(uv, diameter) * np.linspace(0.6, 1.4, 160))
    dots, _ = nearest(found, uv)
    assert len(found) == len(uv)
    assert abs((dots[:, 0] - uv[:, 0]).mean()) < 0.006  # without the correction 0.074


def test_dirt_and_cut_dots_are_left_out():
    uv, diameter = printed(np.random.default_rng(11))
    clean = drawn(uv, diameter)
    image = clean.copy()
    image[:, 90:93] = 20.0  # a scratch through a column of dots
    image = image[:, round(uv[0, 0]):]  # the border through another
    image += np.random.default_rng(12).normal(0, 1, image.shape)
    found, _ = find(image, before=clean)
    uv = uv - [round(uv[0, 0]), 0]
    scratched = np.abs(uv[:, 0] - 91 + 15) < 5
    whole = (uv[:, 0] > 6) & ~scratched
    assert len(found) <= whole.sum() + scratched.sum()
    assert nearest(found, uv[whole])[1].max() < 0.1
    assert nearest(uv[whole], found[:, :2])[1].max() < 0.2


def test_dots_larger_than_the_model_are_reported():
    uv, diameter = printed(np.random.default_rng(13))
    diameter[5] = 11.0
    found, outgrown = find(drawn(uv, diameter))
    assert outgrown and len(found) == len(uv) - 1


@pytest.mark.parametrize('shape', [(0, 0), (0, 9), (9, 0), (1, 1), (3, 5)])
def test_images_too_small_for_a_dot(shape):
    found, outgrown = find(np.zeros(shape))
    assert found.shape == (0, 4) and not outgrown


def test_results_are_in_pixels_of_the_whole_image():
    uv, diameter = printed(np.random.default_rng(5))
    image = np.clip(np.rint(drawn(uv, diameter)), 0, 255).astype(np.uint8)
    once, reduced = (DotFinder(MODEL, replace(LOOK, step=step)).find(image) for step in (1, 2))
    np.testing.assert_allclose(reduced.uv, 2 * once.uv + 0.5)
    np.testing.assert_allclose(reduced.area, 4 * once.area)

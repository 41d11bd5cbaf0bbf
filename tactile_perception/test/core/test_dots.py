# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel measure_dots (src/dots/detect/dot_fits.cpp, disc_fit.cpp, disc_patch.cpp, dot_judge.cpp,
ground_slopes.cpp) against discs drawn sample by sample, and a least-squares fit of all pixels of each dot."""
import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import measure_dots
from tactile_perception.dots.detect.disc_model import DiscModel
from tactile_perception.dots.detect.dot_profile import blurred_disc

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


def measured(image, places, **other):
    """Answer of the kernel for an image (H, W) of any type, rounded, and candidates at these places."""
    look = {'typical': 7.0, 'contrast': CONTRAST, 'ground': int(GROUND), 'noise': 2.0, 'usual': np.nan} | other
    return measure_dots(np.clip(np.rint(image), 0, 255).astype(np.uint8), places, **MODEL.tables, **look)


def nearest(found, uv):
    """For each place (N, 2), the nearest dot of found (M, 4), and its distance."""
    distance = np.hypot(*(uv[:, None] - found[:, :2]).transpose(2, 0, 1))
    return found[distance.argmin(1)], distance.min(1)


def least_squares(image, uv, diameter):
    """u, v, diameter of one dot: Gauss-Newton over its pixels, derivatives by differences, weight falling around the dot's edge."""
    centre, x = np.rint(uv).astype(int), np.arange(-9, 10)
    pixels = image[centre[1] - 9:centre[1] + 10, centre[0] - 9:centre[0] + 10].astype(float).ravel()
    guess = np.array([*(uv - centre), diameter])
    for _ in range(6):
        def disc(p):
            return blurred_disc(np.hypot(x - p[0], (x - p[1])[:, None]), p[2], BLUR).ravel()
        steps = 0.02 * np.eye(3)
        level = np.stack([disc(guess), np.ones(361)], 1)
        away = np.hypot(x - guess[0], (x - guess[1])[:, None]).ravel()
        edge = np.clip((guess[2] / 2 + 2.2 * np.hypot(BLUR, 0.3) - away) / 2 + 0.5, 0, 1)
        root = np.sqrt(edge * edge * (3 - 2 * edge))[:, None]
        amplitude = np.linalg.lstsq(level * root, pixels * root[:, 0], rcond=None)[0][0]
        by_shape = np.stack([amplitude * (disc(guess + s) - disc(guess - s)) / 0.04 for s in steps], 1)
        change = np.linalg.lstsq(np.hstack([by_shape, level]) * root, pixels * root[:, 0], rcond=None)[0]
        guess += change[:3]
    return np.array([*(centre + guess[:2]), guess[2]])


@given(seed=st.integers(0, 2**32 - 1), noise=st.floats(0, 6), off=st.floats(0, 0.6))
@settings(max_examples=6, deadline=None)
def test_fits_are_those_of_least_squares_over_all_pixels(seed, noise, off):
    rng = np.random.default_rng(seed)
    uv, diameter = printed(rng, 3, 4)
    image = np.rint(drawn(uv, diameter, (70, 90)) + rng.normal(0, noise, (70, 90)))
    found, outgrown, _ = measured(image, uv + rng.uniform(-off, off, uv.shape), noise=max(noise, 0.3))
    assert not outgrown and len(found) == len(uv)
    dots, distance = nearest(found, uv)
    expected = np.array([least_squares(image, place, 7.0) for place in uv])
    assert np.abs(dots[:, :2] - expected[:, :2]).max() < 0.01 + 0.003 * noise
    assert np.abs(np.sqrt(4 / np.pi * dots[:, 2]) - expected[:, 2]).max() < 0.05 + 0.02 * noise


def test_places_and_sizes_without_noise():
    uv, diameter = printed(np.random.default_rng(5))
    found, _, usual = measured(drawn(uv, diameter), uv + np.random.default_rng(6).uniform(-0.5, 0.5, uv.shape))
    dots, distance = nearest(found, uv)
    assert np.sqrt((distance**2).mean()) < 0.006
    assert np.abs(np.sqrt(4 / np.pi * dots[:, 2]) - diameter).max() < 0.06
    assert 0 < usual < 0.01


def test_sigma_is_the_spread_of_positions():
    uv, diameter = printed(np.random.default_rng(7))
    image, rng, errors = drawn(uv, diameter), np.random.default_rng(8), []
    for _ in range(30):
        dots, _ = nearest(measured(image + rng.normal(0, 4, image.shape), uv)[0], uv)
        errors.append((dots[:, :2] - uv) / dots[:, 3:])
    # errors over a standard deviation of 22 degrees of freedom: Student's distribution, whose variance is 22 / 20
    assert np.mean(np.square(errors)) == pytest.approx(1.1, abs=0.1)


def test_touching_dots_are_told_apart_and_a_second_candidate_adds_none():
    rng = np.random.default_rng(9)
    uv, diameter = printed(rng)
    for first, second in ((9, 10), (20, 28)):
        step = uv[second] - uv[first]
        uv[second] = uv[first] + step / np.hypot(*step) * (diameter[first] + diameter[second]) / 2
    image = drawn(uv, diameter) + rng.normal(0, 2, (120, 160))
    found, _, _ = measured(image, np.vstack([uv, uv[::7] + 0.8]))
    assert len(found) == len(uv)
    assert nearest(found, uv)[1].max() < 0.08


def test_sloping_light_moves_no_dot():
    uv, diameter = printed(np.random.default_rng(10))
    light = np.linspace(0.6, 1.4, 160)
    found, _, _ = measured(drawn(uv, diameter) * light, uv)
    dots, _ = nearest(found, uv)
    assert len(found) == len(uv)
    assert abs((dots[:, 0] - uv[:, 0]).mean()) < 0.006  # without the correction 0.074


def test_dirt_cut_dots_and_places_without_a_dot_are_left_out():
    uv, diameter = printed(np.random.default_rng(11))
    image = drawn(uv, diameter)
    image[:, 90:93] = 20.0  # a scratch through a column of dots
    image = image[:, round(uv[0, 0]):]  # the border through another
    image += np.random.default_rng(12).normal(0, 1, image.shape)
    uv = uv - [round(uv[0, 0]), 0]
    places = np.vstack([uv, uv + 9, [[np.nan, 5], [np.inf, 5], [-1e300, 5], [1e300, 1e300]]])
    found, _, _ = measured(image, places, usual=0.01)
    scratched = np.abs(uv[:, 0] - 91 + 15) < 5
    whole = (uv[:, 0] > 6) & ~scratched
    assert len(found) <= whole.sum() + scratched.sum()
    assert nearest(found, uv[whole])[1].max() < 0.1
    assert nearest(uv[whole], found[:, :2])[1].max() < 0.2


def test_dots_larger_than_the_model_are_reported():
    uv, diameter = printed(np.random.default_rng(13))
    diameter[5] = 11.0
    found, outgrown, _ = measured(drawn(uv, diameter), uv)
    assert outgrown and len(found) == len(uv) - 1


@pytest.mark.parametrize('shape', [(0, 0), (0, 9), (9, 0), (1, 1), (3, 5)])
def test_images_too_small_for_a_dot(shape):
    found, outgrown, usual = measured(np.zeros(shape), np.array([[0.0, 0.0], [2.0, 1.0]]))
    assert found.shape == (0, 4) and not outgrown and np.isnan(usual)

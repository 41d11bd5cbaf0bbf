# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels water_lengths and skin_light (src/touchpad/water.cpp) against sums over all shares of glare,
and against path_lengths."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import path_lengths, skin_light, water_lengths

CONSTANTS, ABSORPTIONS = np.array([-0.5, -0.4]), np.array([35.0, 27.0])
NOISE = np.array([[9e-6, 4e-6], [4e-6, 7e-6]])
PATH = np.array([-0.005, -0.038, 0.018, 0.2, 0.0, 0.0, -0.04])


def lengths_of(ratios, excess, sigma=0.02, probability=0.3, size=0.1, colour=(0.5, 0.6), count=16, patchiness=0.0):
    """Length and standard deviation, m, of one dot."""
    found = water_lengths(np.array([ratios], float), np.array([count]), np.array([patchiness]), np.array([excess]), np.array([sigma]),
                          np.array([colour], float), constants=CONSTANTS, absorptions=ABSORPTIONS, noise=NOISE.ravel(),
                          disagree=2.5, patchy=2.5, probability=probability, size=size)
    return found[0][0], found[1][0]


def mirrored(length, share, colour=(0.5, 0.6)):
    """Log ratios (2,) of a dot at the end of a path of that length, m, of whose light a share is mirrored."""
    return CONSTANTS - ABSORPTIONS * length + np.log((1 + np.array(colour) * share) / (1 + share))


@given(share=st.floats(0.1, 0.5), length=st.floats(0.01, 0.05))
@settings(max_examples=50, deadline=None)
def test_strong_glare_is_taken_off(share, length):
    ratios = mirrored(length, share)
    with_it, sigma = lengths_of(ratios, np.log1p(share), sigma=0.005, size=0.3)
    without, _ = lengths_of(ratios, np.nan)
    assert abs(with_it - length) < 3 * sigma < 1e-3
    assert abs(with_it - length) < 0.2 * abs(without - length)


def test_ratios_that_disagree_and_patches_widen_the_deviation():
    agree = CONSTANTS - ABSORPTIONS * 0.03
    usual = lengths_of(agree, np.nan)[1]
    assert lengths_of(agree + [0.03, -0.03], np.nan)[1] > 3 * usual
    assert lengths_of(agree, np.nan, patchiness=1e-2)[1] > 3 * usual


def test_where_glare_and_shape_cannot_be_reported_apart_the_deviation_says_so():
    ratios = mirrored(0.033, 0.04)
    usual, doubtful = lengths_of(ratios, np.nan)[1], lengths_of(ratios, np.log1p(0.04))
    assert doubtful[1] > 2.5 * usual and abs(doubtful[0] - 0.033) < 2 * doubtful[1]


@pytest.mark.parametrize('colour', [np.nan, -1.0, 1e4, np.inf])
def test_glare_of_an_unknown_colour_is_not_taken_off(colour):
    ratios = mirrored(0.033, 0.2)
    assert lengths_of(ratios, np.log1p(0.2), colour=(0.5, colour)) == lengths_of(ratios, np.nan)


def test_the_light_on_a_skin_is_that_of_each_place_with_its_normal():
    y, x = np.meshgrid(*[1e-3 * np.arange(-3, 4)] * 2, indexing='ij')
    places = np.stack([x, y, 0.01 + 0.2 * x], axis=-1).reshape(-1, 3)
    normals = np.tile(np.array([-0.2, 0, 1]) / np.hypot(0.2, 1), (49, 1))
    irradiance, lengths = skin_light(PATH, places, normals, rows=7, columns=7)
    rays = places - PATH[4:]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    expected = path_lengths(PATH, places, normals, rays)
    np.testing.assert_allclose(irradiance, expected[2], rtol=1e-9)
    np.testing.assert_allclose(lengths, expected[0], rtol=1e-9)
    wrong_border = skin_light(PATH, places, np.tile([0.0, 0.0, 1.0], (49, 1)), rows=7, columns=7)[0].reshape(7, 7)
    np.testing.assert_allclose(wrong_border[1:-1, 1:-1], irradiance.reshape(7, 7)[1:-1, 1:-1], rtol=1e-12)
    assert np.abs(wrong_border[0] - irradiance.reshape(7, 7)[0]).min() > 0

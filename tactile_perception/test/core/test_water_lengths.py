# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels water_lengths and skin_light (src/touchpad/water.cpp) against sums over all shares of glare,
and against path_lengths."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tactile_perception._core import water_lengths

CONSTANTS, ABSORPTIONS = np.array([-0.5, -0.4]), np.array([35.0, 27.0])
NOISE = np.array([[9e-6, 4e-6], [4e-6, 7e-6]])


def lengths_of(ratios, excess, sigma=0.02, probability=0.3, size=0.1, colour=(0.5, 0.6), count=16):
    """Length and standard deviation, m, of one dot."""
    found = water_lengths(np.array([ratios], float), np.array([count]), np.array([excess]), np.array([sigma]),
                          np.array([colour], float), constants=CONSTANTS, absorptions=ABSORPTIONS, noise=NOISE.ravel(),
                          disagree=2.5, probability=probability, size=size)
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


def test_ratios_that_disagree_widen_the_deviation():
    agree = CONSTANTS - ABSORPTIONS * 0.03
    usual = lengths_of(agree, np.nan)[1]
    assert lengths_of(agree + [0.03, -0.03], np.nan)[1] > 3 * usual


def test_where_glare_and_shape_cannot_be_reported_apart_the_deviation_says_so():
    ratios = mirrored(0.033, 0.04)
    usual, doubtful = lengths_of(ratios, np.nan)[1], lengths_of(ratios, np.log1p(0.04))
    assert doubtful[1] > 2.5 * usual and abs(doubtful[0] - 0.033) < 2 * doubtful[1]


@pytest.mark.parametrize('colour', [np.nan, -1.0, 1e4, np.inf])
def test_glare_of_an_unknown_colour_is_not_taken_off(colour):
    ratios = mirrored(0.033, 0.2)
    assert lengths_of(ratios, np.log1p(0.2), colour=(0.5, colour)) == lengths_of(ratios, np.nan)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy import ndimage
from taxel_pictures import ARRAY, bar, picture
from tactile_perception.taxel.array import SoftPad
from tactile_perception.taxel.traction_watch import TractionWatch

PAD = SoftPad()
LEVEL, NOISE = 4e4, 200.0


def seen(rng, x, traction):
    """Pressure of a bar at x (mm), with the pressure that an even traction along x, over pressure, causes: more before it, less behind."""
    image = picture(bar(x, 0.0, 0.0), LEVEL)
    slope = np.gradient(image.astype(float), axis=1)
    caused = -2.0 * (0.47 * ndimage.gaussian_filter(slope, 1.24) + 0.53 * ndimage.gaussian_filter(slope, 3.7))
    return (image + traction * caused + rng.normal(0, NOISE, image.shape)).astype(np.float32)


def watched(tractions, rested=12, direction=(1.0, 0.0)):
    """Frame in which a bar is told to slide that moves by 0.04 mm a frame with tractions; None where in none."""
    rng, watch = np.random.default_rng(0), TractionWatch(ARRAY, PAD)
    for _ in range(rested):
        watch.rest(seen(rng, 0.0, 0.0), True)
    touched = picture(bar(), LEVEL) > 0.5 * LEVEL
    for k, traction in enumerate(tractions):
        if watch.slides(seen(rng, 0.04 * (k + 1), traction), touched, NOISE, np.array(direction)):
            return k
    return None


def test_traction_that_falls_while_the_object_moves_on_is_slip():
    assert watched([0.04, 0.09, 0.13, 0.13, 0.06, 0.05, 0.05]) in (4, 5)


def test_traction_that_grows_is_none():
    assert watched(np.linspace(0.03, 0.4, 10)) is None


@pytest.mark.parametrize('more', [{'rested': 2}, {'direction': (0.0, 0.0)}])
def test_nothing_is_told_without_a_picture_before_or_a_direction(more):
    assert watched([0.04, 0.09, 0.13, 0.13, 0.06, 0.05, 0.05], **more) is None


def test_a_line_of_taxels_tells_nothing():
    assert not TractionWatch(ARRAY, PAD).slides(np.ones((1, 40), np.float32), np.ones((1, 40), bool), NOISE, np.ones(2))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.special import erf
from scipy.stats import norm

from tactile_perception.dots.detect.dot_profile import blurred_disc, disc_modes


@pytest.mark.parametrize('diameter, blur', [(5.0, 0.6), (9.0, 0.9), (24.0, 1.5)])
def test_a_blurred_disc_keeps_its_area(diameter, blur):
    reach = np.arange(-30, 31)
    x, y = np.meshgrid(reach, reach)
    assert blurred_disc(np.hypot(x - 0.3, y + 0.2), diameter, blur).sum() == pytest.approx(np.pi / 4 * diameter**2, rel=1e-3)


@pytest.mark.parametrize('diameter', [1.5, 4.0, 14.0, 30.0])
@pytest.mark.parametrize('blur', [0.0, 0.3, 1.0, 3.2])
def test_so_many_strips_are_enough(diameter, blur):
    radius = np.arange(0, 20, 1 / 24)  # px, at the samples of the profile
    sigma, half, angle = np.hypot(blur, 12 ** -0.5), diameter / 2, (np.arange(4000) + 0.5) / 4000 * np.pi - np.pi / 2
    chord = erf(half * np.cos(angle) / sigma / np.sqrt(2)) * half * np.cos(angle) * np.pi / 4000
    fine = norm.pdf(radius[:, None], half * np.sin(angle), sigma) @ chord
    assert np.abs(blurred_disc(radius, diameter, blur) - fine).max() < 1e-6


def test_the_profile_is_that_of_sampled_discs(draw_dots):
    image = draw_dots([[20.3, 19.8]], [7.0], shape=(40, 40), ground=0.0, contrast=1.0)
    y, x = np.mgrid[:40, :40]
    assert np.abs(image - blurred_disc(np.hypot(x - 20.3, y - 19.8), 7.0, 0.9)).max() < 0.01


def test_modes_are_the_differences_of_images():
    y, x = (a.astype(float) for a in np.mgrid[-8:9, -8:9])
    modes = disc_modes(x, y, 7.0, 0.9)
    step = 0.05
    by_u = (blurred_disc(np.hypot(x - step, y), 7.0, 0.9) - blurred_disc(np.hypot(x + step, y), 7.0, 0.9)) / (2 * step)
    by_diameter = (blurred_disc(np.hypot(x, y), 7.0 + step, 0.9) - blurred_disc(np.hypot(x, y), 7.0 - step, 0.9)) / (2 * step)
    assert np.abs(modes.by_u - by_u).max() < 0.01
    assert np.abs(modes.by_diameter - by_diameter).max() < 0.005
    assert np.abs(modes.by_v - modes.by_u.T).max() < 1e-9

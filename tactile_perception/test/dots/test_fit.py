# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The image of a dot, the tables of its fit, and what dots look like in an image."""
import numpy as np
import pytest
from scipy.special import erf

from tactile_perception.dots.fit import DiscModel, blurred_disc, disc_modes
from tactile_perception.dots.look import measure_look
from tactile_perception.errors import BadFrame


def noisy(image, noise=2.0):
    return np.clip(image + np.random.default_rng(1).normal(0, noise, image.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('blur', [0.6, 0.9, 1.4])
def test_blur_size_and_contrast_are_measured(draw_dots, lattice, blur):
    uv, diameter = lattice
    look = measure_look(noisy(draw_dots(uv, diameter, blur=blur)), -1)
    assert look.blur == pytest.approx(blur, abs=0.1)
    assert look.typical == pytest.approx(np.median(diameter), rel=0.06)
    assert look.contrast == pytest.approx(-120, rel=0.05)
    assert look.ground == pytest.approx(180, rel=0.03)
    assert look.noise == pytest.approx(2.0, rel=0.3)
    assert look.smallest < diameter.min() and look.largest > diameter.max()


@pytest.mark.parametrize('sign', [1, -1])
def test_noise_alone_has_no_dots(sign):
    with pytest.raises(BadFrame, match='polarity'):
        measure_look(noisy(np.full((240, 320), 120.0), 5.0), sign)


@pytest.mark.parametrize('diameter', [1.5, 4.0, 14.0, 30.0])
@pytest.mark.parametrize('blur', [0.0, 0.3, 1.0, 3.2])
def test_so_many_strips_are_enough(diameter, blur):
    radius = np.arange(0, 20, 1 / 24)  # px, at the samples of the profile
    sigma, half, angle = np.hypot(blur, 12 ** -0.5), diameter / 2, (np.arange(4000) + 0.5) / 4000 * np.pi - np.pi / 2
    chord = erf(half * np.cos(angle) / sigma / np.sqrt(2)) * half * np.cos(angle) * np.pi / 4000
    fine = (np.exp(-0.5 * ((radius[:, None] - half * np.sin(angle)) / sigma)**2) / (np.sqrt(2 * np.pi) * sigma)) @ chord
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


@pytest.mark.parametrize('smallest, largest, blur', [(0.8, 1.2, 0.3), (1.5, 2.0, 0.5), (3.0, 5.0, 0.8), (9.0, 14.0, 1.5)])
def test_tables_of_dots_of_any_size_have_all_directions_of_the_basis(smallest, largest, blur):
    model, other = DiscModel(smallest, largest, blur), DiscModel(8.0, 10.0, 1.0)
    assert model.basis.shape[1] == other.basis.shape[1]
    assert model.estimators.shape[-2:] == (5, model.basis.shape[1]) and np.isfinite(model.estimators).all()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.detect.appearance import measure_look, select_channel
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


def test_the_channel_with_the_dots_is_taken(draw_dots, lattice):
    image = np.random.default_rng(0).normal(100, 2, (120, 160, 3))
    image[:, :, 1] = draw_dots(*lattice, ground=30.0, contrast=150.0)
    look = measure_look(noisy(image), 1)
    assert look.channel == 'green'
    assert select_channel(noisy(image), 'green').ndim == 2


def test_large_dots_are_looked_at_in_a_smaller_image(draw_dots):
    uv = np.array([[30.0 + 50 * k, 30.0 + 50 * r] for k in range(3) for r in range(3)])
    look = measure_look(noisy(draw_dots(uv, np.full(9, 24.0), shape=(170, 170))), -1)
    assert look.step == 2
    assert look.typical == pytest.approx(12.0, rel=0.05)


@pytest.mark.parametrize('sign', [1, -1])
def test_noise_alone_has_no_dots(sign):
    with pytest.raises(BadFrame, match='polarity'):
        measure_look(noisy(np.full((240, 320), 120.0), 5.0), sign)

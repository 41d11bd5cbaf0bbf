# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The image of a dot, the tables of its fit, and what dots look like in an image."""
import numpy as np
import pytest

from tactile_perception.dots.fit import DiscModel
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


@pytest.mark.parametrize('smallest, largest, blur', [(0.8, 1.2, 0.3), (1.5, 2.0, 0.5), (3.0, 5.0, 0.8), (9.0, 14.0, 1.5)])
def test_tables_of_dots_of_any_size_have_all_directions_of_the_basis(smallest, largest, blur):
    model, other = DiscModel(smallest, largest, blur), DiscModel(8.0, 10.0, 1.0)
    assert model.basis.shape[1] == other.basis.shape[1]
    assert model.estimators.shape[-2:] == (5, model.basis.shape[1]) and np.isfinite(model.estimators).all()

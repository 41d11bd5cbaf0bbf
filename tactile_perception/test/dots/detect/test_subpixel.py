# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.detect.subpixel import LikelihoodFitter


@pytest.fixture
def fitted(draw_dots, lattice):
    """A fitter, and a fit of noise-free dots begun up to 0.7 px off their places."""
    uv, diameter = lattice
    fitter = LikelihoodFitter(4.0, 10.0, 0.9)
    image = draw_dots(uv, diameter)
    padded = np.pad(image, fitter.half, mode='edge')
    start = uv + np.random.default_rng(6).uniform(-0.5, 0.5, uv.shape)
    centre = np.rint(start).astype(int)
    compressed = fitter.compress(fitter.patches(padded, centre[:, 0], centre[:, 1]), 180.0)
    return fitter, fitter.fit(compressed, *(start - centre).T, np.full(len(uv), 7.0), 3), centre, compressed


def test_places_sizes_and_contrast_without_noise(fitted, lattice):
    _, fit, centre, _ = fitted
    uv, diameter = lattice
    error = centre + np.stack([fit.u, fit.v], 1) - uv
    assert np.sqrt((error**2).sum(1).mean()) < 0.004
    assert np.abs(fit.diameter - diameter).max() < 0.05
    assert fit.amplitude == pytest.approx(np.full(len(uv), -120.0), rel=0.01)
    assert np.abs(fit.ground).max() < 0.5


def test_little_variance_is_left_without_noise_and_all_of_it_with(fitted):
    fitter, fit, _, compressed = fitted
    assert np.median(fitter.variances(compressed, fit)) < 0.2
    rng = np.random.default_rng(7)
    noise = rng.normal(0, 5, (len(compressed), (2 * fitter.half + 1) ** 2)).astype(np.float32)
    assert np.mean(fitter.variances(compressed + fitter.compress(noise), fit)) == pytest.approx(25, rel=0.1)


def test_gains_are_the_spread_of_fits(fitted):
    fitter, fit, _, compressed = fitted
    rng = np.random.default_rng(8)
    spread = []
    for _ in range(60):
        noise = rng.normal(0, 3, (len(compressed), (2 * fitter.half + 1) ** 2)).astype(np.float32)
        again = fitter.fit(compressed + fitter.compress(noise), fit.u, fit.v, fit.diameter, 2)
        spread.append((again.u - fit.u) ** 2)
    place = fitter.gains(fit)
    assert np.mean(np.mean(spread, 0) / (9 * place)) == pytest.approx(1, abs=0.1)

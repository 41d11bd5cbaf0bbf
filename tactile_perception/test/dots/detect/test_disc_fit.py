# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.dots.detect.disc_fit import fit_discs

RNG = np.random.default_rng(1)
UV = np.stack(np.divmod(np.arange(24), 4), 1) * 46.0 + 40.3 + RNG.uniform(-0.5, 0.5, (24, 2))
DIAMETERS = RNG.uniform(20, 24, 24)


def photographed(draw_dots, noise=2.0, bright=True, ground=40.0):
    discs = draw_dots(UV, DIAMETERS, (220, 320), 1.0, 0.0, 1.0)
    image = (ground + 120 * discs if bright else 200 - 120 * discs) + np.random.default_rng(2).normal(0, noise, discs.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('bright', [True, False])
def test_whole_discs_are_placed_from_rough_places(draw_dots, bright):
    start = UV + np.random.default_rng(3).uniform(-2, 2, UV.shape)
    dots = fit_discs(photographed(draw_dots, bright=bright), 1 if bright else -1, start, 22.0)
    error = dots.uv - UV
    assert np.sqrt((error**2).mean()) < 0.08
    assert 0.5 < np.sqrt((error**2).mean() / (dots.sigma**2).mean()) < 2
    np.testing.assert_allclose(2 * np.sqrt(dots.area / np.pi), DIAMETERS, rtol=0.06)


def test_discs_that_have_lost_an_eighth_at_the_edge_stay_where_they_were(draw_dots):
    """A centroid goes off by a tenth of the radius and more."""
    whole = photographed(draw_dots).astype(float)
    y, x = np.mgrid[:220, :320]
    for (u, v), d in zip(UV, DIAMETERS):
        whole[np.hypot(x - u - 0.42 * d, y - v) < 0.22 * d] = 40
    dots = fit_discs(whole.astype(np.uint8), 1, UV + 1.0, 22.0)
    assert np.abs(dots.uv - UV).mean() < 0.04 * 22
    assert (np.hypot(*(dots.uv - UV).T) / dots.sigma).mean() < 3


def test_no_texture_gives_no_numbers_that_are_not_finite(draw_dots):
    dots = fit_discs(np.full((220, 320), 70, np.uint8), 1, UV, 22.0)
    assert np.isfinite(dots.uv).all() and np.isfinite(dots.sigma).all() and (dots.area > 0).all()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect import DotDetector
from tactile_perception.dots.worn import find_discs, fit_discs, measure_diameter
from tactile_perception.errors import BadFrame

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', ''))
UV = np.stack(np.divmod(np.arange(24), 4), 1) * 46.0 + 40.3


def speckled(draw_dots, diameter=22.0, share=0.45):
    discs = draw_dots(UV, np.full(24, diameter), (220, 320), 0.8, 0.0, 1.0)
    bare = cv2.GaussianBlur(np.random.default_rng(0).normal(size=discs.shape), (0, 0), 1.5)
    return np.clip(30 + 120 * discs * (bare < np.quantile(bare, 1 - share)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('channel', [None, 0, 1, 2])
def test_speckled_discs_in_the_channel_that_shows_them(draw_dots, channel):
    image = speckled(draw_dots)
    if channel is not None:
        grey, image = image, np.full((*image.shape, 3), 60, np.uint8)
        image[..., channel] = grey
    dots = DotDetector('bright', 'discs').detect(image)
    away = np.hypot(*(dots.uv[:, None] - UV).transpose(2, 0, 1))
    assert sorted(away.argmin(axis=1)) == list(range(24)) and np.sqrt((away.min(axis=1)**2).mean() / 2) < 1.0
    assert 2 * np.sqrt(np.median(dots.area) / np.pi) == pytest.approx(22, rel=0.1)


def test_the_scale_is_measured_anew_when_discs_get_lost(draw_dots):
    detector = DotDetector('bright', 'discs')
    assert len(detector.detect(speckled(draw_dots, 28.0))) == 24
    assert len(detector.detect(speckled(draw_dots, 7.0, 0.0))) == 24


def test_a_frame_without_discs_is_refused():
    slope = np.tile(np.linspace(80, 120, 160).astype(np.uint8), (120, 1))
    with pytest.raises(BadFrame, match='polarity'):
        DotDetector('bright', 'discs').detect(slope)


@pytest.mark.skipif(not (RECORDINGS / 'pin_array_127').is_dir(), reason='TACTILE_RECORDINGS holds no pin_array_127')
def test_pins_are_found_and_the_streaks_beside_them_are_not():
    for path in sorted((RECORDINGS / 'pin_array_127').glob('frame_*.png'))[:10]:
        assert 127 <= len(DotDetector('bright', 'discs').detect(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))) <= 135


def picture(draw_dots, diameter, seed=0, bright=True, speckle=0.5):
    """24 discs, of whose pixels a share is bare, in light of two to one."""
    rng = np.random.default_rng(seed)
    discs = draw_dots(UV, np.full(24, float(diameter)), (220, 320), 0.8, 0.0, 1.0)
    bare = cv2.GaussianBlur(rng.normal(size=discs.shape), (0, 0), 1.2)
    ink = discs * (bare < np.quantile(bare, 1 - speckle))
    image = (30 + 110 * ink if bright else 150 - 110 * ink) * np.linspace(1, 0.5, 320) + rng.normal(0, 2, discs.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


@pytest.mark.parametrize('diameter', [9, 16, 28])
@pytest.mark.parametrize('bright', [True, False])
def test_the_scale_is_the_discs_own_and_not_their_speckles(draw_dots, diameter, bright):
    measured = measure_diameter(picture(draw_dots, diameter, bright=bright), 1 if bright else -1)
    assert 0.9 * diameter < measured < 1.35 * diameter


def test_speckled_discs_are_found_once_each(draw_dots):
    found = find_discs(picture(draw_dots, 24), 1, 26.0)
    away = np.hypot(*(found.uv[:, None] - UV).transpose(2, 0, 1))
    strong = found.amplitude > 0.5 * np.median(found.amplitude)
    assert sorted(away.argmin(axis=1)[strong]) == list(range(24)) and away.min(axis=1)[strong].max() < 4


def test_a_streak_and_a_disc_cut_by_the_border_are_none(draw_dots):
    image = np.full((200, 200), 20, np.uint8)
    cv2.line(image, (-20, 55), (220, 95), 200, 14)
    cv2.circle(image, (100, 150), 10, 200, -1)
    cv2.circle(image, (198, 150), 10, 200, -1)
    found = find_discs(cv2.GaussianBlur(image, (0, 0), 1.0), 1, 20.0)
    assert len(found) == 1 and np.hypot(*(found.uv[0] - [100, 150])) < 1.5


def test_pictures_of_nothing_have_no_scale():
    assert np.isnan(measure_diameter(np.full((120, 160), 90, np.uint8), 1))
    assert len(find_discs(np.zeros((40, 40), np.uint8), 1, 12.0)) == 0


RNG = np.random.default_rng(1)
OFF_GRID = np.stack(np.divmod(np.arange(24), 4), 1) * 46.0 + 40.3 + RNG.uniform(-0.5, 0.5, (24, 2))
DIAMETERS = RNG.uniform(20, 24, 24)


def photographed(draw_dots, noise=2.0, bright=True, ground=40.0):
    discs = draw_dots(OFF_GRID, DIAMETERS, (220, 320), 1.0, 0.0, 1.0)
    image = (ground + 120 * discs if bright else 200 - 120 * discs) + np.random.default_rng(2).normal(0, noise, discs.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('bright', [True, False])
def test_whole_discs_are_placed_from_rough_places(draw_dots, bright):
    start = OFF_GRID + np.random.default_rng(3).uniform(-2, 2, OFF_GRID.shape)
    dots = fit_discs(photographed(draw_dots, bright=bright), 1 if bright else -1, start, 22.0)
    error = dots.uv - OFF_GRID
    assert np.sqrt((error**2).mean()) < 0.13
    assert 0.5 < np.sqrt((error**2).mean() / (dots.sigma**2).mean()) < 2
    np.testing.assert_allclose(2 * np.sqrt(dots.area / np.pi), DIAMETERS, rtol=0.06)


def test_discs_that_have_lost_an_eighth_at_the_edge_stay_where_they_were(draw_dots):
    """A centroid goes off by a tenth of the radius and more."""
    whole = photographed(draw_dots).astype(float)
    y, x = np.mgrid[:220, :320]
    for (u, v), d in zip(OFF_GRID, DIAMETERS):
        whole[np.hypot(x - u - 0.42 * d, y - v) < 0.22 * d] = 40
    dots = fit_discs(whole.astype(np.uint8), 1, OFF_GRID + 1.0, 22.0)
    assert np.abs(dots.uv - OFF_GRID).mean() < 0.04 * 22
    assert (np.hypot(*(dots.uv - OFF_GRID).T) / dots.sigma).mean() < 3


def test_no_texture_gives_no_numbers_that_are_not_finite(draw_dots):
    dots = fit_discs(np.full((220, 320), 70, np.uint8), 1, OFF_GRID, 22.0)
    assert np.isfinite(dots.uv).all() and np.isfinite(dots.sigma).all() and (dots.area > 0).all()

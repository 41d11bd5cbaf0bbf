# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect.disc_correlation import Peaks, explained_energy, find_discs, measure_diameter, shrunk

UV = np.stack(np.divmod(np.arange(24), 4), 1) * 46.0 + 40.3


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
    found = find_discs(cv2.GaussianBlur(image, (0, 0), 1.0), 1, 20.0, least=0.6)
    assert len(found) == 1 and np.hypot(*(found.uv[0] - [100, 150])) < 1.5


def test_pictures_of_nothing_have_no_scale():
    assert np.isnan(measure_diameter(np.full((120, 160), 90, np.uint8), 1))
    assert len(find_discs(np.zeros((40, 40), np.uint8), 1, 12.0)) == 0


def test_shrunk_says_the_factors_that_came_out():
    small, scale = shrunk(np.zeros((101, 203), np.uint8), 0.37)
    np.testing.assert_allclose(scale, [small.shape[1] / 203, small.shape[0] / 101])
    assert shrunk(np.zeros((10, 10), np.uint8), 1.0)[0].shape == (10, 10)


def test_a_reflection_does_not_outweigh_discs():
    some = Peaks(np.zeros((5, 2)), np.full(5, 0.8), np.array([10, 10, 10, 10, 200.0]))
    assert explained_energy(some, 2.0) == pytest.approx(5 * 100 * 0.64 * 4)
    assert explained_energy(Peaks(np.zeros((3, 2)), np.ones(3), np.ones(3)), 2.0) == 0

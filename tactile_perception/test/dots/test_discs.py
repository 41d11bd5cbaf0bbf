# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Discs of an image, which of them are no doubles, and which are likely to be dots of one print."""
import numpy as np
import pytest

from tactile_perception._core.dots import likely_dots
from tactile_perception.dots.appearance import discs_at, find_peaks, without_doubles


def off(found, wanted):
    """Distance, px, of each wanted position (N, 2) to each found one (M, 2)."""
    return np.hypot(*(wanted[:, None] - found).transpose(2, 0, 1))


def picture(draw_dots, sign, seed=0, noise=2.0):
    """(168, 296) uint8 with 40 discs of 9 px; and their positions (40, 2) px."""
    rng = np.random.default_rng(seed)
    uv = np.stack(np.divmod(np.arange(40), 5), axis=1) * [34.0, 30.0] + [26, 24] + rng.uniform(-3, 3, (40, 2))
    image = draw_dots(uv, np.full(40, 9.0), (168, 296), ground=120.0, contrast=60.0 * sign) + rng.normal(0, noise, (168, 296))
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), uv


@pytest.mark.parametrize('sign', [-1, 1])
@pytest.mark.parametrize('seed', [0, 1])
def test_drawn_discs_are_found_within_a_pixel_and_no_others(draw_dots, sign, seed):
    image, uv = picture(draw_dots, sign, seed)
    found = find_peaks(image, (-1, 1), 9.0)
    away = off(found[sign].uv, uv)
    # The image is reduced to 6 px a disc: its pixels are 1.5 px wide, and half of their diagonal is 1.06 px.
    assert away.shape == (40, 40) and away.min(axis=0).max() < 1.1 and away.min(axis=1).max() < 1.1
    assert (found[sign].correlation > 0.9).all()
    np.testing.assert_allclose(found[sign].amplitude, 60, rtol=0.2)  # the blur takes some of it
    assert np.abs(found[sign].ground - 120).max() < 10
    assert not (found[-sign].correlation > 0.7).any()


def test_discs_at_positions_say_what_is_there(draw_dots):
    image, uv = picture(draw_dots, 1)
    middle = (uv[:-5] + uv[5:]) / 2
    seen, empty, dark = discs_at(image, 1, uv, 9.0), discs_at(image, 1, middle, 9.0), discs_at(image, -1, uv, 9.0)
    assert seen.correlation.min() > 0.8 and np.abs(empty.correlation).max() < 0.7
    assert seen.amplitude.min() > 40 and np.abs(empty.amplitude).max() < 4
    np.testing.assert_array_equal(dark.amplitude, -seen.amplitude)
    assert len(discs_at(image, 1, np.zeros((0, 2)), 9.0).uv) == 0
    outside = discs_at(image, 1, np.array([[-50.0, -50.0], [1e6, 1e6]]), 9.0)
    assert np.isfinite(outside.correlation).all()


@pytest.mark.parametrize('count', [0, 1, 2, 300])
def test_of_two_near_positions_the_one_with_the_higher_score_is_kept(count):
    rng = np.random.default_rng(count)
    uv, score, apart = rng.uniform(0, 100, (count, 2)), rng.uniform(size=count), rng.uniform(1, 6, count)
    near = off(uv, uv) < np.maximum(apart[:, None], apart)
    is_beaten = (near & (score > score[:, None])).any(axis=1)
    np.testing.assert_array_equal(without_doubles(uv, score, apart), ~is_beaten)


def test_a_large_disc_is_compared_with_all_small_ones_that_it_covers():
    small = np.stack(np.meshgrid(np.arange(1.0, 12), np.arange(-5.0, 6)), axis=-1).reshape(-1, 2)
    kept = without_doubles(np.vstack([[0.0, 0.0], small]), np.append(1.0, np.zeros(len(small))), np.append(20.0, np.full(len(small), 0.5)))
    np.testing.assert_array_equal(np.flatnonzero(kept), [0])


def print_and_specks(seed):
    """Positions (68, 2) px and logarithms of contrast and diameter (68, 2): 48 dots of a print, then 20 specks of any size."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.divmod(np.arange(48), 8), axis=1) * 20.0 + rng.normal(0, 0.5, (48, 2))
    specks = rng.uniform([0, 170], [110, 300], (20, 2))
    return np.vstack([grid, specks]), np.vstack([rng.normal([4, 2], 0.05, (48, 2)), rng.uniform([2, 0], [6, 4], (20, 2))])


@pytest.mark.parametrize('seed', range(4))
def test_dots_of_a_print_are_told_from_specks(seed):
    uv, logarithms = print_and_specks(seed)
    kept, log_odds, known = likely_dots(uv, logarithms, np.zeros(68), None)
    assert kept[:48].all() and kept[48:].sum() <= 1 and log_odds > 20 and known.regular > 0.8
    again, *_ = likely_dots(uv[40:], logarithms[40:], np.zeros(28), known)
    np.testing.assert_array_equal(again[:8], True)
    assert again[8:].sum() <= 1


def test_a_few_discs_are_no_print():
    for count in (0, 1, 5):
        uv, logarithms = (values[:count] for values in print_and_specks(0))
        kept, _, known = likely_dots(uv, logarithms, np.zeros(count), None)
        assert known is None and len(kept) == count and not kept.any()

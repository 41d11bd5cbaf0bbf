# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.press.published.gaussian_peak import gaussian, grid_point

PITCH = (4.5e-3, 4.5e-3)
PLACES = np.stack(np.meshgrid(np.arange(-6, 7) * 4.5e-3, np.arange(-4, 5) * 4.5e-3), -1)


def bell(centre, height=5e-3, width=7e-3):
    return height * np.exp(-np.sum((PLACES - centre) ** 2, axis=-1) / (2 * width**2))


def test_a_gaussian_is_found_again():
    x = np.arange(5) * 1.0
    assert gaussian(x, 3 * np.exp(-0.4 * (x - 2.3) ** 2)) == pytest.approx((2.3, 3.0))


@pytest.mark.parametrize('y', [np.exp(0.3 * (np.arange(5) - 2.0) ** 2), np.ones(5)])
def test_a_fit_that_opens_upwards_or_is_flat_has_no_peak(y):
    assert np.isnan(gaussian(np.arange(5.0), y)).all()


def test_the_papers_fit_is_exact_on_its_own_bell():
    point = grid_point(bell((1.3e-3, -2.1e-3)), PLACES, PITCH)
    assert point.reason == '' and not point.at_edge
    assert point.place == pytest.approx([1.3e-3, -2.1e-3], abs=1e-9)
    assert point.depth == pytest.approx(5e-3 * np.exp(-(0.8e-3**2 + 1.0e-3**2 + 2.1e-3**2 - 1.0e-3**2) / 4 / 49e-6), rel=0.1)


def test_a_depth_at_or_under_zero_is_left_out_by_the_weighted_fit():
    deep = bell((1e-3, 1e-3))
    deep[4, 8] = -1e-4
    point = grid_point(deep, PLACES, PITCH)
    assert point.reason == 'weighted' and point.place == pytest.approx([1e-3, 1e-3], abs=1e-6)


def test_at_the_border_the_weighted_fit_is_one_sided():
    point = grid_point(bell((26.5e-3, 0.5e-3)), PLACES, PITCH)
    assert point.at_edge and point.reason == 'weighted' and point.place == pytest.approx([26.5e-3, 0.5e-3], abs=1e-6)


def test_where_a_line_is_broken_the_patch_still_tells():
    deep = bell((1e-3, 1e-3))
    deep[4, [4, 5, 7, 8]] = np.nan
    point = grid_point(deep, PLACES, PITCH)
    assert point.reason == 'two_dimensional' and point.place == pytest.approx([1e-3, 1e-3], abs=1e-6)


def test_a_flat_top_falls_back_to_the_centroid():
    deep = np.where(np.abs(PLACES).max(-1) < 14e-3, 3e-3, 0.0)
    deep[4, 6] += 1e-9
    point = grid_point(deep, PLACES, PITCH)
    assert point.reason == 'centroid' and point.place == pytest.approx([0, 0], abs=1e-8) and point.depth == pytest.approx(3e-3)


def test_one_deep_marker_alone_is_its_own_place():
    deep = np.zeros((9, 13))
    deep[0, 0] = 1e-3
    point = grid_point(deep, PLACES, PITCH)
    assert point.reason == 'centroid' and point.at_edge and point.place == pytest.approx(PLACES[0, 0])


def test_nothing_deep_is_no_point():
    assert grid_point(np.zeros((9, 13)), PLACES, PITCH) is None
    assert grid_point(np.full((9, 13), np.nan), PLACES, PITCH) is None


def test_random_depths_never_leave_the_neighbourhood():
    rng = np.random.default_rng(0)
    for _ in range(200):
        deep = rng.normal(0, 1e-3, (9, 13))
        deep[rng.random((9, 13)) < 0.3] = np.nan
        point = grid_point(deep, PLACES, PITCH)
        top = PLACES[np.unravel_index(np.nanargmax(deep), deep.shape)]
        assert np.abs(point.place - top).max() <= 2 * 4.5e-3 + 1e-12 and 0 < point.depth <= 1.5 * np.nanmax(deep)

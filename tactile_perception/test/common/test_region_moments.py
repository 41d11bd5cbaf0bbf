# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.contour import region_outlines
from tactile_perception.common.dot_surface import DotSurface


def moments_of(score, surface):
    return region_outlines(score, surface)[1]


def test_area_of_a_part_of_the_cap(pad):
    score = np.clip(0.5 + (6e-3 - np.hypot(*pad.rest[:, :2].T)) / pad.pitch, 0, 1).reshape(23, 23)
    found, = moments_of(score, DotSurface(pad.rest.reshape(23, 23, 3)))
    tall = pad.cap.curvature_radius - np.sqrt(pad.cap.curvature_radius**2 - 36e-6)
    assert found.area == pytest.approx(2 * np.pi * pad.cap.curvature_radius * tall, rel=0.01)
    np.testing.assert_allclose(found.normal, [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(found.centroid, [0, 0, pad.cap.height - tall / 2], atol=10e-6)


def test_ring_loses_its_hole_and_keeps_its_middle(pad):
    radius = np.hypot(*(pad.rest[:, :2] - [1e-3, -0.5e-3]).T) / pad.pitch
    flat = pad.rest * [1, 1, 0]
    found, = moments_of(np.clip(0.5 + np.minimum(6 - radius, radius - 3.5), 0, 1).reshape(23, 23), DotSurface(flat.reshape(23, 23, 3)))
    assert found.area == pytest.approx(np.pi * (36 - 12.25) * pad.pitch**2, rel=0.02)
    np.testing.assert_allclose(found.centroid, [1e-3, -0.5e-3, 0], atol=30e-6)
    assert np.diag(found.spread) == pytest.approx((36 + 12.25) / 4 * pad.pitch**2 * np.ones(2), rel=0.03)


def test_regions_add_up(pad):
    place = pad.rest[:, :2] / pad.pitch
    score = np.clip(0.5 + 3 - np.minimum(np.hypot(*(place - [5, 0]).T), np.hypot(*(place + [5, 0]).T)), 0, 1).reshape(23, 23)
    one, other = moments_of(score, DotSurface((pad.rest * [1, 1, 0]).reshape(23, 23, 3)))
    both = one + other
    assert both.area == pytest.approx(2 * one.area, rel=1e-6)
    np.testing.assert_allclose(both.centroid, 0, atol=1e-8)
    assert both.spread[0, 0] == pytest.approx((2.25 + 25) * pad.pitch**2, rel=0.03)


def test_pitch_is_that_of_the_dots(pad):
    surface = DotSurface((pad.rest * [1, 1, 0]).reshape(23, 23, 3))
    score = (np.hypot(*pad.rest[:, :2].T) < 4e-3).astype(float).reshape(23, 23)
    assert region_outlines(score, surface)[2] == pytest.approx(pad.pitch)

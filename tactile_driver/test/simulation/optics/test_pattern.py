# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.optics.pattern import SurfaceSampler, WidePattern
from tactile_driver.simulation.sensors.touchpad import touchpad_camera, touchpad_dots
from tactile_driver.simulation.skin.dome import Membrane
from tactile_driver.simulation.skin.sheet import Sheet


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=49)


@pytest.fixture(scope='module')
def pattern(membrane):
    return touchpad_dots(membrane, np.random.default_rng(4))


def test_sampler_finds_places_and_tangents_on_the_resting_skin(membrane):
    square = np.random.default_rng(0).uniform(-0.85, 0.85, (100, 2))
    sampler = SurfaceSampler(square, membrane.nodes)
    np.testing.assert_allclose(sampler.places(membrane.rest), membrane.surface(square), atol=3e-6)
    step = 1e-4
    for axis in (0, 1):
        shift = np.eye(2)[axis] * step
        slope = (membrane.surface(square + shift) - membrane.surface(square - shift)) / (2 * step) * 2 / (membrane.nodes - 1)
        np.testing.assert_allclose(sampler.tangents(membrane.rest)[:, :, axis], slope, atol=2e-5)


def test_529_dots_stand_in_rows_and_columns_inside_the_picture(membrane, pattern):
    camera = touchpad_camera()
    places, uv, _ = pattern.seen(membrane.rest, camera)
    assert uv.shape == (529, 2) and (pattern.rows, pattern.columns) == (23, 23)
    assert uv.min() > 8 and (uv < [632, 472]).all()
    grid = uv.reshape(23, 23, 2)
    assert np.diff(grid[:, :, 0], axis=1).mean() == pytest.approx(18.6, abs=0.6)
    assert (np.diff(grid[:, :, 0], axis=1) > 12).all() and (np.diff(grid[:, :, 1], axis=0) > 12).all()
    np.testing.assert_allclose(np.linalg.norm(places - membrane.centre, axis=1), membrane.radius, atol=5e-6)
    assert places[:, 2].min() > 0.001


def test_dots_are_painted_by_hand(membrane, pattern):
    assert 0.012e-3 < pattern.radius.std() < 0.03e-3 and pattern.radius.mean() == pytest.approx(0.40e-3, rel=0.02)
    other = touchpad_dots(membrane, np.random.default_rng(5))
    off = pattern.sampler.places(membrane.rest) - other.sampler.places(membrane.rest)
    assert 0.05e-3 < off[:, 0].std() < 0.12e-3


def test_painted_disc_keeps_its_size_on_the_resting_skin(membrane, pattern):
    laid = pattern.sampler.tangents(membrane.rest) @ pattern.painted
    np.testing.assert_allclose(laid.transpose(0, 2, 1) @ laid, np.broadcast_to(np.eye(2), (529, 2, 2)), atol=1e-9)


def test_places_may_be_corrected_before_they_are_seen(membrane, pattern):
    camera = touchpad_camera()
    places, uv, _ = pattern.seen(membrane.rest, camera, lambda p: p + [1e-4, 0, 0])
    np.testing.assert_allclose(uv, camera.project(places))
    np.testing.assert_allclose(places, pattern.sampler.places(membrane.rest) + [1e-4, 0, 0])


def test_a_wide_disc_on_a_bent_sheet_appears_at_the_centroid_of_its_image():
    sheet, camera = Sheet(0.133, 0.091, 70.0, 1.25, 3.5e-4, 97), touchpad_camera()
    centre, radius = np.array([[0.004, 0.003, 0.0], [-0.012, 0.006, 0.0]]), np.array([2.1e-3, 1.9e-3])

    def bent(xyz):
        return xyz - [0, 0, 2.5e-3] * np.exp(-(xyz[..., :2]**2).sum(axis=-1, keepdims=True) / 0.008**2)

    pattern = WidePattern(sheet, centre, radius, np.arange(2))
    _, uv, spread = pattern.seen(bent(sheet.rest), camera)
    share = (np.arange(200) + 0.5) / 200
    ring, turn = np.meshgrid(np.sqrt(share), 2 * np.pi * share)
    for k in range(2):
        inside = centre[k] + radius[k] * np.stack([ring * np.cos(turn), ring * np.sin(turn), 0 * ring], axis=-1).reshape(-1, 3)
        step = 1e-6 * np.eye(3)[:2]
        seen, right, down = (camera.project(bent(inside + move)) for move in (0 * step[0], *step))
        size = np.abs(np.linalg.det(np.stack([right - seen, down - seen], axis=-1))) / 1e-12
        off = uv[k] - (size[:, None] * seen).sum(axis=0) / size.sum()
        assert np.linalg.norm(off) < 0.03
        assert np.abs(np.linalg.det(spread[k])) == pytest.approx(size.mean(), rel=2e-3)
    assert np.linalg.norm(uv[0] - camera.project(bent(centre[0]))) > 0.5

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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Cameras, light, dots and their pictures."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tactile_driver.simulation.optics.light import Lamps, Lighting
from tactile_driver.simulation.optics.pattern import LargeDots
from tactile_driver.simulation.optics.rendering import Imaging, Renderer
from tactile_driver.simulation.sensors.touchpad import touchpad_camera, touchpad_dots
from tactile_driver.simulation.skin.surfaces import Membrane, Rubber, Sheet

PLACES = np.array([[0.0, 0, 0.013], [0.01, 0.004, 0.008], [-0.012, 0.013, 0.004], [0.004, -0.015, 0.006]])


@pytest.fixture
def camera():
    return touchpad_camera()


def test_projection_agrees_with_opencv(camera):
    uv, _ = cv2.projectPoints(PLACES, cv2.Rodrigues(camera.rotation)[0], camera.translation, camera.matrix, camera.distortion)
    np.testing.assert_allclose(camera.project(PLACES), uv[:, 0], atol=1e-9)


def test_rays_undo_the_projection(camera):
    rays = camera.rays(camera.project(PLACES))
    arms = PLACES - camera.centre
    np.testing.assert_allclose(rays, arms / np.linalg.norm(arms, axis=1, keepdims=True), atol=1e-6)


LAMPS = Lamps(((0.0, 0.0, -0.03),), (100.0,), 0.03, 20.0, (0.5, 1.0, 0.25), exposure=1.0)


def look(lamps, shape):
    up = np.zeros_like(shape)
    up[..., 2] = 1
    return lamps.look(shape.astype(np.float32), up.astype(np.float32))


def test_light_falls_off_with_distance_and_slant():
    light, _ = look(LAMPS, np.array([[[0, 0, 0], [0.03, 0, 0], [0, 0, 0.03]]]))
    # squarely at its reach; at 45 degrees and twice the square of the distance; squarely at twice the distance
    expected = 20 + 100 * np.array([1, 0.5 * np.sqrt(0.5), 0.25])
    np.testing.assert_allclose(light[0], expected[:, None] * [0.5, 1.0, 0.25], rtol=1e-5)


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=49)


@pytest.fixture(scope='module')
def pattern(membrane):
    return touchpad_dots(membrane, np.random.default_rng(4))


def test_a_wide_disc_on_a_bent_sheet_appears_at_the_centroid_of_its_image():
    sheet, camera = Sheet(0.133, 0.091, Rubber(70.0, 1.25, 3.5e-4), 97), touchpad_camera()
    centre, radius = np.array([[0.004, 0.003, 0.0], [-0.012, 0.006, 0.0]]), np.array([2.1e-3, 1.9e-3])

    def bent(xyz):
        return xyz - [0, 0, 2.5e-3] * np.exp(-(xyz[..., :2]**2).sum(axis=-1, keepdims=True) / 0.008**2)

    pattern = LargeDots(sheet, centre, radius, np.arange(2))
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


MATT = replace(Lighting(), gloss=0.0)


def drawn(membrane, lighting=MATT, imaging=Imaging(), number=None, width=640, ink=True):
    """A picture of the resting pad and its dots' positions."""
    camera = touchpad_camera(width)
    pattern = touchpad_dots(membrane, np.random.default_rng(0))
    _, uv, spread = pattern.seen(membrane.rest, camera)
    imaging = imaging if ink else replace(imaging, ink=0.0)
    return Renderer(membrane, camera, lighting, imaging, 0).draw(membrane.coarse(membrane.rest), uv, spread, pattern.radius, number), uv


def dark_centroids(picture, clean, uv, half):
    """Centroids (K, 2) of what the dots take away from the clean picture, in boxes of 2 half + 1 px."""
    share = 1 - picture[..., 2].astype(float) / np.maximum(clean[..., 2].astype(float), 1)
    out = []
    for u, v in np.round(uv).astype(int):
        box = share[v - half:v + half + 1, u - half:u + half + 1]
        y, x = np.mgrid[v - half:v + half + 1, u - half:u + half + 1]
        out.append([(box * x).sum() / box.sum(), (box * y).sum() / box.sum()])
    return np.array(out)


@pytest.mark.parametrize('width, limit', [(640, 0.05), (320, 0.05)])
def test_dots_are_drawn_where_the_truth_says(membrane, width, limit):
    (picture, uv), (clean, _) = drawn(membrane, width=width), drawn(membrane, width=width, ink=False)
    off = dark_centroids(picture, clean, uv, 8 if width == 640 else 4)
    error = off - uv
    assert np.abs(error.mean(axis=0)).max() < 0.01
    assert np.sqrt((error**2).mean()) < 0.5 * limit
    assert np.abs(error).max() < 3 * limit  # eight bits


def test_noise_is_as_asked_and_new_in_each_frame(membrane):
    clean, _ = drawn(membrane)
    frames = np.stack([drawn(membrane, number=k)[0] for k in range(6)]).astype(float)
    bright = clean[..., 2] > 120
    level = clean[..., 2][bright].mean()
    assert frames[:, bright, 2].std(axis=0, ddof=1).mean() == pytest.approx(np.sqrt(0.64 + 0.016 * level), rel=0.12)
    first, second = (frames[k, bright, 2] - clean[..., 2][bright] for k in (0, 1))
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.1
    np.testing.assert_array_equal(drawn(membrane, number=3)[0], frames[3].astype(np.uint8))


def look_water(membrane, lighting, flatten=0.0):
    """Light and spots of the resting skin, or of one lowered by flatten m in the middle."""
    camera = touchpad_camera()
    shape = membrane.rest.copy()
    shape[..., 2] -= flatten * np.exp(-(shape[..., 0]**2 + shape[..., 1]**2) / 0.006**2)
    normals = membrane.area_vectors(shape).reshape(shape.shape)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return lighting.look(shape, normals, camera.project(shape), camera, 0.8)


def test_light_decays_by_beer_and_lambert(membrane):
    dim, _ = look_water(membrane, replace(Lighting(), ambient=0.0, absorption=(80.0, 80.0, 80.0)))
    clear, _ = look_water(membrane, replace(Lighting(), ambient=0.0, absorption=(0.0, 0.0, 0.0)))
    # lamp to skin to camera passes 16.5 mm of water twice in the middle, on a slanted path from the lamps
    path = -np.log(dim[24, 24, 1] / clear[24, 24, 1]) / 80
    down = 0.0165
    slant = down * np.sqrt(1 + (0.024 / 0.047)**2)
    assert path == pytest.approx(down + slant, rel=0.01)


@pytest.mark.parametrize('water', [0.0, 1.0])
def test_sheen_is_where_the_lamps_are_mirrored_and_has_the_colour_asked_for(membrane, water):
    lighting = replace(Lighting(), sheen=0.1, sheen_width=0.05, sheen_water=water)
    (matt, (positions, _, peak)), (wet, _) = look_water(membrane, Lighting()), look_water(membrane, lighting)
    extra = wet - matt
    camera = touchpad_camera()
    nodes = camera.project(membrane.rest)
    brightest = nodes[np.unravel_index(extra[..., 2].argmax(), extra.shape[:2])]
    assert np.linalg.norm(positions[peak > 20] - brightest, axis=1).min() < 15
    assert 0.03 < (extra[..., 2] / matt[..., 2]).max() < 0.6 and (extra[..., 2] > 0.01 * matt[..., 2]).mean() < 0.5
    most = np.unravel_index(extra[..., 2].argmax(), extra.shape[:2])
    blue, _, red = extra[most] / np.array(lighting.gain)
    assert blue / red == pytest.approx(1, rel=1e-3) if water == 0 else blue / red < 0.2

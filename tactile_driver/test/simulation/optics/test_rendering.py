# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from tactile_driver.simulation.optics.rendering import Imaging, Renderer
from tactile_driver.simulation.optics.water_light import Lighting
from tactile_driver.simulation.sensors.touchpad import touchpad_camera, touchpad_dots
from tactile_driver.simulation.skin.dome import Membrane

MATT = replace(Lighting(), gloss=0.0)


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=49)


def drawn(membrane, lighting=MATT, imaging=Imaging(), number=None, width=640, ink=True):
    """A picture of the resting pad and its dots' places."""
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


def test_a_skin_that_is_drawn_again_is_the_same_under_other_noise(membrane):
    camera = touchpad_camera(320)
    pattern = touchpad_dots(membrane, np.random.default_rng(0))
    shape, (_, uv, spread) = membrane.coarse(membrane.rest), pattern.seen(membrane.rest, camera)
    again, moved = (Renderer(membrane, camera, MATT, replace(Imaging(), drift=0.1), 0) for _ in range(2))
    for number in (1, 2, None):
        fresh = Renderer(membrane, camera, MATT, replace(Imaging(), drift=0.1), 0).draw(shape, uv, spread, pattern.radius, number)
        np.testing.assert_array_equal(again.draw(shape, uv, spread, pattern.radius, number), fresh)
        moved.draw(shape, uv + 5.0, spread, pattern.radius, number)
        np.testing.assert_array_equal(moved.draw(shape, uv, spread, pattern.radius, number), fresh)


def test_reflections_of_the_window_stay_in_place_and_are_white(membrane):
    imaging = replace(Imaging(), reflections=((300.0, 200.0, 3.0, 60.0),))
    for width, scale in ((640, 1.0), (320, 0.5)):
        clean, spotted = (drawn(membrane, imaging=kind, width=width)[0].astype(float) for kind in (Imaging(), imaging))
        extra = spotted - clean
        v, u = np.unravel_index(extra.sum(axis=2).argmax(), extra.shape[:2])
        assert np.hypot((u + 0.5) / scale - 300.5, (v + 0.5) / scale - 200.5) < 2.5
        assert extra[v, u, :2] == pytest.approx([60, 60], abs=6)
        rows, columns = np.mgrid[:extra.shape[0], :extra.shape[1]]
        assert extra[np.hypot(rows - v, columns - u) > 20 * scale].max() <= 1

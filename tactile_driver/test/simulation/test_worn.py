# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Worn markers."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from tactile_driver.errors import BadArgument
from tactile_driver.simulation.optics.wear import Wear, WornPrint
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.sensors.worn_sheet import LAYOUTS, WORN_SHEET_SCENES, Print, worn_sheet

STEPS = np.arange(-20, 21)


def print_left(wear, count=40, radius=16.0):
    """Ink left on markers of 16 px radius, and the mask of their discs."""
    which, off = np.arange(count), np.zeros((count, 2))
    left = WornPrint(wear, count).left(which, off, np.tile(np.eye(2) / radius, (count, 1, 1)), STEPS, 0.5)
    return left, np.hypot(STEPS[:, None], STEPS) < radius - 1


@pytest.mark.parametrize('missing', [0.1, 0.3])
def test_chips_take_their_share(missing):
    left, disc = print_left(Wear(missing=missing))
    assert 1 - left[:, disc].mean() == pytest.approx(missing, abs=0.05)


def test_speckle_leaves_its_share_in_grains_of_their_size():
    fine, disc = print_left(Wear(speckle=0.8, grain=0.12))
    coarse, _ = print_left(Wear(speckle=0.8, grain=0.35))
    assert fine[:, disc].mean() == pytest.approx(1 - 0.8 * 0.29, abs=0.04)
    assert np.abs(np.diff(fine, axis=2))[:, disc[:, 1:]].mean() > 1.3 * np.abs(np.diff(coarse, axis=2))[:, disc[:, 1:]].mean()


def test_wear_goes_with_the_marker_and_is_its_own():
    wear = Wear.of(1.0, 3)
    worn = WornPrint(wear, 2)
    turned = np.array([[[0, 1], [-1, 0]], [[1, 0], [0, 1]]]) / 16.0
    left = worn.left(np.array([0, 0]), np.zeros((2, 2)), turned, STEPS, 0.5)
    np.testing.assert_allclose(left[0], np.rot90(left[1], -1), atol=0.05)
    other = worn.left(np.array([1]), np.zeros((1, 2)), turned[1:], STEPS, 0.5)
    assert np.abs(other[0] - left[1]).mean() > 0.1


def picture(print_, seed=1):
    specimen = worn_sheet(seed, 640, print_)
    skin, pattern, camera = specimen.skin, specimen.pattern, specimen.cameras[0]
    _, uv, spread = pattern.seen(skin.rest, camera)
    return specimen.renderers[0].draw(skin.coarse(skin.rest), uv, spread.astype(np.float32), pattern.radius, None).mean(axis=2), uv


def shares(wear):
    """Mean level of markers and of what is beside them."""
    image, uv = picture(Print(wear=wear, light=1.0, diameter=20, count=80))
    u, v = np.rint(uv).astype(int).T
    return np.mean([image[v + a, u + b] for a in (-4, 0, 4) for b in (-4, 0, 4)]), np.mean([image[v, u + 19], image[v + 19, u]])


def test_worn_markers_are_darker_and_the_ground_is_not():
    new, worn = shares(0.0), shares(1.0)
    assert worn[0] - worn[1] < 0.75 * (new[0] - new[1])
    assert worn[1] == pytest.approx(new[1], rel=0.35)


@pytest.mark.parametrize('layout', LAYOUTS)
@pytest.mark.parametrize('diameter, count', [(8, 350), (24, 150), (40, 50)])
def test_as_many_markers_as_asked_stand_apart_in_the_picture(layout, diameter, count):
    specimen = worn_sheet(2, 640, Print(diameter, count, layout))
    _, uv, spread = specimen.pattern.seen(specimen.skin.rest, specimen.cameras[0])
    assert 0.7 * count < len(uv) < 1.3 * count
    assert cKDTree(uv).query(uv, 2)[0][:, 1].min() > 1.1 * diameter
    assert uv.min() > diameter / 2 and (uv < [640 - diameter / 2, 480 - diameter / 2]).all()
    across = 2 * np.median(specimen.pattern.radius * np.sqrt(np.abs(np.linalg.det(spread))))
    assert across == pytest.approx(diameter, rel=0.06)


def test_polarity_and_contrast():
    for bright in (True, False):
        scene = worn_sheet(1, 640, Print(bright=bright, wear=0.0, light=1.0, contrast=4.0, uneven=0.0))
        skin, pattern = scene.skin, scene.pattern
        _, uv, spread = pattern.seen(skin.rest, scene.cameras[0])
        image = scene.renderers[0].draw(skin.coarse(skin.rest), uv, spread.astype(np.float32), pattern.radius, None).mean(axis=2)
        u, v = np.rint(uv).astype(int).T
        ratio = np.median(image[v, u]) / np.median(image[v, u + 18])
        assert ratio == pytest.approx(4.0 if bright else 0.25, rel=0.1)


def test_an_unknown_layout_is_refused_with_the_known_ones():
    with pytest.raises(BadArgument, match='grid, hexagonal, random'):
        worn_sheet(0, 640, Print(layout='spiral'))


@pytest.mark.parametrize('name', WORN_SHEET_SCENES)
def test_scenes_press_the_sheet(name):
    scene = open_scene(name, rate=5.0)
    touched = [len(scene.observe(k).truth.contacts) for k in range(15)]
    assert touched[0] == 0 and max(touched) == 1

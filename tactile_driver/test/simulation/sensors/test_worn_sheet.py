# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial import cKDTree

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.sensors.worn_sheet import LAYOUTS, WORN_SHEET_SCENES, Print, worn_sheet


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


def test_a_grid_has_rows_and_columns_and_others_have_none():
    grid, other = worn_sheet(0).pattern, worn_sheet(0, 640, Print(layout='random')).pattern
    assert grid.rows * grid.columns == len(grid.numbers) and grid.rows > 5
    assert (other.rows, other.columns) == (0, 0)


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

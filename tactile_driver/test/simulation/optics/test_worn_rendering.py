# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.optics.worn_rendering import SideLight
from tactile_driver.simulation.sensors.worn_sheet import Print, worn_sheet


def picture(print_, seed=1):
    specimen = worn_sheet(seed, 640, print_)
    skin, pattern, camera = specimen.skin, specimen.pattern, specimen.cameras[0]
    _, uv, spread = pattern.seen(skin.rest, camera)
    return specimen.renderers[0].draw(skin.coarse(skin.rest), uv, spread.astype(np.float32), pattern.radius, None).mean(axis=2), uv


@pytest.mark.parametrize('ratio', [1.0, 3.0])
def test_light_falls_off_by_its_ratio(ratio):
    half = 0.03, 0.02
    y, x = np.mgrid[-1:1:21j, -1:1:21j]
    shape = np.stack([0.03 * x, 0.02 * y, 0 * x], axis=-1)
    normals = np.tile([0, 0, 1.0], (21, 21, 1))
    light, _ = SideLight((100, 120, 140), ratio, 0.7, half).look(shape, normals, None)
    assert light[..., 0].max() == pytest.approx(100, rel=1e-3) and light.max() / light.min() == pytest.approx(1.4 * ratio, rel=1e-3)


def shares(wear):
    """Mean level of markers and of what is beside them."""
    image, uv = picture(Print(wear=wear, light=1.0, diameter=20, count=80))
    u, v = np.rint(uv).astype(int).T
    return np.mean([image[v + a, u + b] for a in (-4, 0, 4) for b in (-4, 0, 4)]), np.mean([image[v, u + 19], image[v + 19, u]])


def test_worn_markers_are_darker_and_the_ground_is_not():
    new, worn = shares(0.0), shares(1.0)
    assert worn[0] - worn[1] < 0.75 * (new[0] - new[1])
    assert worn[1] == pytest.approx(new[1], rel=0.35)


def test_the_picture_is_the_same_for_the_same_seed_and_another_for_another():
    one, again, other = picture(Print(), 3)[0], picture(Print(), 3)[0], picture(Print(), 4)[0]
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).mean() > 3

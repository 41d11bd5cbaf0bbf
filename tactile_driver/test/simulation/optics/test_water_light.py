# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from tactile_driver.simulation.optics.water_light import Illumination, Lighting, lamp_places
from tactile_driver.simulation.sensors.touchpad import touchpad_camera
from tactile_driver.simulation.skin.dome import Membrane


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=49)


def look(membrane, lighting, flatten=0.0):
    """Light and spots of the resting skin, or of one lowered by flatten m in the middle."""
    camera = touchpad_camera()
    shape = membrane.rest.copy()
    shape[..., 2] -= flatten * np.exp(-(shape[..., 0]**2 + shape[..., 1]**2) / 0.006**2)
    normals = membrane.area_vectors(shape).reshape(shape.shape)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return Illumination(camera, lighting, 0.8).look(shape, normals, camera.project(shape))


def test_light_decays_by_beer_and_lambert(membrane):
    dim, _ = look(membrane, replace(Lighting(), ambient=0.0, absorption=(80.0, 80.0, 80.0)))
    clear, _ = look(membrane, replace(Lighting(), ambient=0.0, absorption=(0.0, 0.0, 0.0)))
    # lamp to skin to camera passes 16.5 mm of water twice in the middle, the lamps' way slanted
    way = -np.log(dim[24, 24, 1] / clear[24, 24, 1]) / 80
    down = 0.0165
    slant = down * np.sqrt(1 + (0.024 / 0.047)**2)
    assert way == pytest.approx(down + slant, rel=0.01)


def test_each_lamp_has_its_mirror_image_on_the_resting_skin(membrane):
    lighting = Lighting()
    _, (place, form, peak) = look(membrane, lighting)
    camera = touchpad_camera()
    strong = peak > 20
    assert strong.sum() == lighting.lamps == len(lamp_places(lighting))
    distance = np.linalg.norm(place[strong] - camera.project(np.array([0, 0, 0.013])), axis=1)
    assert distance == pytest.approx(distance.mean(), rel=0.06)
    assert 40 < distance.mean() < 160
    width = 1 / np.sqrt(np.linalg.eigvalsh(form[strong]))
    assert (0.8 < width).all() and (width < 9).all()


@pytest.mark.parametrize('water', [0.0, 1.0])
def test_sheen_is_where_the_lamps_are_mirrored_and_has_the_colour_asked_for(membrane, water):
    lighting = replace(Lighting(), sheen=0.1, sheen_width=0.05, sheen_water=water)
    (matt, (place, _, peak)), (wet, _) = look(membrane, Lighting()), look(membrane, lighting)
    extra = wet - matt
    camera = touchpad_camera()
    nodes = camera.project(membrane.rest)
    brightest = nodes[np.unravel_index(extra[..., 2].argmax(), extra.shape[:2])]
    assert np.linalg.norm(place[peak > 20] - brightest, axis=1).min() < 15
    assert 0.03 < (extra[..., 2] / matt[..., 2]).max() < 0.6 and (extra[..., 2] > 0.01 * matt[..., 2]).mean() < 0.5
    most = np.unravel_index(extra[..., 2].argmax(), extra.shape[:2])
    blue, _, red = extra[most] / np.array(lighting.gain)
    assert blue / red == pytest.approx(1, rel=1e-3) if water == 0 else blue / red < 0.2

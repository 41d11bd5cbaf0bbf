# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Untouched sensors report no contact: images with noise, glare and drift."""
from dataclasses import replace

import numpy as np
import pytest
import rig
from rig import untouched
from tactile_driver.simulation.optics.water_light import Lighting
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.sensors.touchpad import touchpad

MANY = pytest.mark.slow, pytest.mark.timeout(1200)


def noisy_frames(of, count, level):
    """Untouched frames with noise of so many grey levels beyond the camera's own."""
    rng = np.random.default_rng(6)
    fields = rng.standard_normal((4, *of.rest[0].shape), np.float32)
    for _ in range(count):
        one, other = rng.choice(len(fields), 2, replace=False)
        noise = (fields[one] + np.roll(fields[other], tuple(rng.integers(0, 400, 2)), (0, 1))) * np.float32(level / np.sqrt(2))
        yield np.clip(np.rint(of.rest[rng.integers(0, len(of.rest))] + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('level, count', [(1, 20), (4, 20), pytest.param(3, 1000, marks=MANY)])
@pytest.mark.parametrize('sensor', rig.SENSORS[:4])
def test_no_contact_in_noisy_images(sensor, level, count):
    of = rig.seen(sensor)
    chain = of.chain()
    assert all(untouched(chain(image)) for image in noisy_frames(of, count, level))


def test_no_contact_under_noise_of_a_taxel_array():
    of, rng = rig.seen('taxel_array'), np.random.default_rng(3)
    chain = of.chain()
    for _ in range(300):
        values = of.rest[0] + rng.normal(0, 1.0, of.rest[0].shape)
        assert untouched(chain(np.clip(np.rint(values), 0, 255).astype(np.uint8)))


def false_with_glare(count, seed, lighting=None):
    """Of `count` untouched frames of another specimen with glare, lamps in the window and a drifting gain, those with anything found;
    lighting: another than the scene's."""
    scene = open_scene('glare_rest', rate=30.0, seed=seed)
    if lighting is not None:
        scene._renderer = touchpad(seed, 640, lighting, replace(scene._renderer.imaging, drift_period=40)).renderers[0]
    chain = rig.camera('touchpad', scene=scene, at=0.5).chain()
    return sum(not untouched(chain(scene.render(k / 30).image, rig.FIRST_NS + round(k / 30 * 1e9))) for k in range(count))


WHITE = {'gloss': 700.0, 'gloss_width': 0.01, 'sheen_width': 0.041, 'sheen_water': 0.0}


@pytest.mark.parametrize('seed, count, light', [(11, 40, None), (1, 30, {**WHITE, 'sheen': 0.16}), (3, 30, {**WHITE, 'sheen': 0.2}),
                                                *(pytest.param(seed, 1000, None, marks=MANY) for seed in range(21, 26))])
def test_no_contact_with_glare_white_highlights_and_drift(seed, count, light):
    assert false_with_glare(count, seed, light and Lighting(**light)) == 0

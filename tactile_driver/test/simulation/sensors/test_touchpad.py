# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_driver.simulation.sensors.touchpad import TOUCHPAD_SCENES


def test_glare_is_brighter_and_noise_noisier_than_usual():
    pictures = {}
    for name in ('rest', 'glare', 'noise'):
        specimen = TOUCHPAD_SCENES[name].build(0, 320)
        _, uv, spread = specimen.pattern.seen(specimen.skin.rest, specimen.cameras[0])
        shape, radius = specimen.skin.coarse(specimen.skin.rest), specimen.pattern.radius
        pictures[name] = [specimen.renderers[0].draw(shape, uv, spread, radius, number).astype(float) for number in (None, 1)]
    assert (pictures['glare'][0] == 255).sum() > (pictures['rest'][0] == 255).sum()
    noise = {name: (noisy - clean).std() for name, (clean, noisy) in pictures.items()}
    assert noise['noise'] > 1.5 * noise['rest']
    np.testing.assert_array_equal(pictures['noise'][0], pictures['rest'][0])

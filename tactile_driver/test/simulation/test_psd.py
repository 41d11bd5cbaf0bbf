# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated finger."""

import numpy as np
import pytest
from tactile_driver.errors import BadArgument
from tactile_driver.simulation.psd.scene import Electronics, FingerSpecimen, PSD_SCENES, open_psd_scene


def normals(theta, phi=0.3):
    theta = np.radians(np.atleast_1d(theta))
    return np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)], axis=1)


def test_light_rises_with_depth_before_and_after_touch_and_falls_towards_the_rim():
    finger = FingerSpecimen(3)
    depth = np.linspace(0, 4e-4, 60)
    light = finger.light(np.repeat(normals(20), 60, axis=0), depth).sum(1)
    assert light[0] == 0 and (np.diff(light) > 0).all()
    assert 0.15 < finger.light(normals(0), np.array([finger.material.gap]))[0].sum() < 0.4
    rim = finger.light(normals([0, 20, 40, 60, 75]), np.full(5, 3e-4)).sum(1)
    assert (np.diff(rim) < 0).all() and rim[-1] < 0.25 * rim[0]


def test_the_converter_ends_where_the_amplifiers_do():
    rng = np.random.default_rng(0)
    counts = Electronics().counts(np.array([[0.0, 1.0, 4.9, 9.0]] * 2000), rng)
    assert counts.dtype == np.uint16 and counts[:, 3].max() == counts[:, 3].min() == int(4.95 / 5 * 4096)
    assert counts[:, 1].mean() == pytest.approx(819, abs=1.5) and 8 < counts[:, 1].std() < 11


RATE = 1000.0


@pytest.mark.parametrize('name', sorted(PSD_SCENES))
def test_every_scene_plays_with_its_truth(name):
    scene = open_psd_scene(name, 200.0, 1)
    counts, truth = scene.play(0, scene.samples)
    assert counts.shape == (scene.samples, 4) and counts.dtype == np.uint16
    touching = truth.touching > 0
    assert np.isfinite(truth.normal[touching]).all() and np.isnan(truth.normal[~touching]).all()
    assert np.linalg.norm(truth.normal[touching], axis=1) == pytest.approx(1.0)
    assert touching.any() == (name not in ('rest', 'light'))


def test_it_goes_on_from_where_it_was_and_begins_again():
    scene = open_psd_scene('demo', RATE)
    truth = scene.play(0, scene.samples)[1]
    assert np.array_equal(scene.play(scene.samples + 500, 1200)[1].touching, truth.touching[500:1700])
    k = int(np.flatnonzero(truth.touching)[5])
    touch, = truth.touches(k)
    assert np.linalg.norm(touch.position) == pytest.approx(0.016) and touch.force > 0
    assert truth.touches(0) == []


def test_wrong_words():
    with pytest.raises(BadArgument, match='calibration, demo'):
        open_psd_scene('nowhere', RATE)
    with pytest.raises(BadArgument, match='rate'):
        open_psd_scene('demo', 0.0)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's model of stick and slip on random scenes: halved and doubled constants, other frame rates, more noise, and whether its
probabilities are right. Dots are seen with the noise of images, their ranges are smoothed by the membrane."""
from functools import lru_cache

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
from fit_contact_score import KINDS, random_scene
from tactile_driver.simulation.sensors.touchpad import COLUMNS, ROWS
from tactile_perception import _core
from tactile_perception.touchpad.contact import border_network, state_confidence
from tactile_perception.touchpad.membrane import Membrane, MembraneMaterial

PIXEL, SPREAD = 15e-6, 18e-6  # rad, m: noise of a dot's place in the image, and of its range
RATE = 20.0  # frames/s
NEAR = 50e-6  # m: a free dot nearer to the tool is not judged
DECIDE = [name for name in dir(_core.StickSlipModel) if not name.startswith('_')]
pytestmark = pytest.mark.full


@lru_cache(maxsize=3)
def seen(rate, noise=1.0):
    """Of each scene: the camera's centre, the membrane, and of each frame the dots' places, true states, and which are judged."""
    return [_seen(random_scene(number, 8800, rate), np.random.default_rng(number), noise)
            for number in (KINDS.index(kind) + 24 for kind in ('block', 'disc', 'ball', 'edge', 'balls'))]


def _seen(scene, rng, noise):
    skin, frames = scene.membrane, []
    origin, truths = -scene.camera.rotation.T @ scene.camera.translation, [scene.observe(k).truth for k in range(scene.frames)]
    rest = truths[0].dot_xyz
    membrane = Membrane(rest, ROWS, COLUMNS, origin, MembraneMaterial(skin.tension, skin.pressure, skin.radius))
    membrane.core.reset(0.0)
    for truth in truths:
        away = truth.dot_xyz - origin
        ranges = np.linalg.norm(away, axis=1)
        rays = away / ranges[:, None] + noise * PIXEL * rng.normal(size=away.shape)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        state = membrane.solve(rays, ranges + noise * SPREAD * rng.normal(size=len(ranges)), np.full(len(ranges), noise * SPREAD),
                               np.arange(len(ranges)))
        frames.append((state.xyz, truth.dot_state, (truth.dot_state > 0) | (truth.dot_gap > NEAR)))
    return origin, membrane.core, frames


def classified(scenes, rate, every=1, changed=None, factor=1.0):
    """Counts (3, 3) of true by found states, and of each dot that touches: stated probability, and whether the state is right."""
    counts, reported = np.zeros((3, 3)), []
    for origin, membrane, frames in scenes:
        model = _core.StickSlipModel()
        if changed:
            setattr(model, changed, factor * getattr(model, changed))
        classifier = _core.DotClassifier(membrane, origin, border_network(), model)
        for xyz, true, judged in frames[::every]:
            found = classifier.classify(np.arange(len(true)), xyz, every / rate)
            np.add.at(counts, (true[judged], found.state[judged]), 1)
            near = judged & ((found.state > 0) | (true > 0))
            reported.append(np.column_stack([state_confidence(found.score, found.state, found.slipping), found.state == true])[near])
    return counts, np.concatenate(reported)


def f1(counts):
    """Mean F1 of sticking and of slipping dots among those that touch and are found to."""
    both = counts[1:, 1:]
    return float(np.mean(2 * np.diag(both) / (both.sum(axis=0) + both.sum(axis=1))))


def test_no_constant_decides_alone():
    scenes = seen(RATE)
    usual = f1(classified(scenes, RATE)[0])
    found = {(name, factor): f1(classified(scenes, RATE, changed=name, factor=factor)[0]) for name in DECIDE for factor in (0.5, 2.0)}
    assert {which: value for which, value in found.items() if value < usual - 0.25 * (1 - usual)} == {}, usual


def test_it_degrades_with_rate_and_noise_and_does_not_break():
    usual = f1(classified(seen(RATE), RATE)[0])
    assert f1(classified(seen(RATE), RATE, every=2)[0]) > usual - 0.08
    assert f1(classified(seen(2 * RATE), 2 * RATE)[0]) > usual - 0.05
    assert f1(classified(seen(RATE, 3.0), RATE)[0]) > usual - 0.1


def test_of_states_reported_with_nine_tenths_nine_in_ten_are_right():
    _, reported = classified(seen(RATE), RATE)
    about = (reported[:, 0] > 0.85) & (reported[:, 0] < 0.95)
    assert about.sum() > 500 and reported[about, 1].mean() == pytest.approx(0.9, abs=0.06)

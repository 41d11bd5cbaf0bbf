# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's models of membrane and of stick and slip on random scenes: halved and doubled constants, other frame rates, more noise,
and whether their probabilities are right. Dots are seen with the noise of images, their ranges are smoothed by the membrane."""
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
from fit_contact_score import KINDS, random_scene
from tactile_driver.simulation.sensors.touchpad import COLUMNS, ROWS
from tactile_perception import _core
from tactile_perception.common.estimates import NONE, next_state
from tactile_perception.touchpad.contact import border_network, state_confidence
from tactile_perception.touchpad.membrane import Membrane, MembraneMaterial
from tactile_perception.touchpad.slip import slip_confidence

PIXEL, SPREAD = 15e-6, 18e-6  # rad, m: noise of a dot's place in the image, and of its range
GAIN, SCALE = 0.03, 0.05  # relative error that the displacements along the rays share, and its standard deviation as known
RATE = 20.0  # frames/s
NEAR = 50e-6  # m: a free dot nearer to the tool is not judged
TOOLS = 'block', 'disc', 'ball', 'edge', 'balls'
DECIDE = {model: [name for name in dir(model) if not name.startswith('_')] for model in (_core.StickSlipModel, _core.MembraneModel)}
pytestmark = pytest.mark.full


@lru_cache(maxsize=4)
def measured(rate, noise=1.0, seed=8800):
    """The scenes: what is seen of them, and the truth."""
    return [_measured(random_scene(KINDS.index(kind) + 24, seed, rate), np.random.default_rng(KINDS.index(kind) + 24), noise)
            for kind in TOOLS]


def _measured(scene, rng, noise):
    skin, origin = scene.membrane, -scene.camera.rotation.T @ scene.camera.translation
    truths = [scene.observe(k).truth for k in range(scene.frames)]
    rest = truths[0].dot_xyz
    at_rest, frames = np.linalg.norm(rest - origin, axis=1), []
    for truth in truths:
        away = truth.dot_xyz - origin
        ranges = np.linalg.norm(away, axis=1)
        rays = away / ranges[:, None] + noise * PIXEL * rng.normal(size=away.shape)
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        ranges = ranges + GAIN * (ranges - at_rest) + noise * SPREAD * rng.normal(size=len(ranges))
        frames.append((rays, ranges, np.full(len(ranges), noise * SPREAD), np.arange(len(ranges))))
    return SimpleNamespace(origin=origin, rest=rest, material=MembraneMaterial(skin.tension, skin.pressure, skin.radius), frames=frames,
                           truths=truths)


@lru_cache(maxsize=4)
def seen(rate, noise=1.0, seed=8800):
    """Of each scene: the camera's centre, the membrane, and of each frame the dots' places, true states, and which are judged."""
    return [_solved(scene) for scene in measured(rate, noise, seed)]


def _solved(scene, model=None):
    membrane = Membrane(scene.rest, ROWS, COLUMNS, scene.origin, scene.material, model)
    membrane.core.reset(SCALE)
    frames = [(membrane.solve(*frame).xyz, truth.dot_state, (truth.dot_state > 0) | (truth.dot_gap > NEAR))
              for frame, truth in zip(scene.frames, scene.truths)]
    return scene.origin, membrane.core, frames


def changed(kind, name, factor):
    """A model with that constant so many times as large."""
    model = kind()
    setattr(model, name, factor * getattr(model, name))
    return model


def classified(scenes, rate, every=1, model=_core.StickSlipModel()):
    """Counts (3, 3) of true by found states, and of each dot that touches: stated probability, and whether the state is right."""
    counts, reported = np.zeros((3, 3)), []
    for origin, membrane, frames in scenes:
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


def test_no_constant_of_stick_and_slip_decides_alone():
    scenes, kind = seen(RATE), _core.StickSlipModel
    usual = f1(classified(scenes, RATE)[0])
    found = {(name, factor): f1(classified(scenes, RATE, model=changed(kind, name, factor))[0])
             for name in DECIDE[kind] for factor in (0.5, 2.0)}
    assert {which: value for which, value in found.items() if value < usual - 0.25 * (1 - usual)} == {}, usual


def placed(model):
    """Root mean square error of the places of dots that touch, m; relative error of the force; and F1 of contact."""
    place, force, counts = [], [], np.zeros((2, 2))
    for scene in measured(RATE)[::2]:
        origin, membrane, frames = _solved(scene, model)
        classifier = _core.DotClassifier(membrane, origin, border_network())
        for (xyz, true, judged), truth in zip(frames, scene.truths):
            found = classifier.classify(np.arange(len(true)), xyz, 1 / RATE)
            place.append(np.square(xyz - truth.dot_xyz).sum(axis=1)[true > 0])
            np.add.at(counts, ((true > 0)[judged].astype(int), (found.state > 0)[judged].astype(int)), 1)
            if np.linalg.norm(truth.wrench[:3]) > 0.3:
                force.append(np.linalg.norm(found.wrench[:3] - truth.wrench[:3]) / np.linalg.norm(truth.wrench[:3]))
    wrong = 1 - 2 * counts[1, 1] / (counts[1].sum() + counts[:, 1].sum())
    return np.array([np.sqrt(np.mean(np.concatenate(place))), np.median(force), wrong])


def test_no_constant_of_the_membrane_decides_alone():
    kind = _core.MembraneModel
    usual = placed(kind())
    found = {(name, factor): placed(changed(kind, name, factor)) / usual for name in DECIDE[kind] for factor in (0.5, 2.0)}
    assert {which: errors for which, errors in found.items() if (errors > 1.35).any()} == {}


def test_it_degrades_with_rate_and_noise_and_does_not_break():
    usual = f1(classified(seen(RATE), RATE)[0])
    assert f1(classified(seen(RATE), RATE, every=2)[0]) > usual - 0.08
    assert f1(classified(seen(2 * RATE), 2 * RATE)[0]) > usual - 0.05
    assert f1(classified(seen(RATE, 3.0), RATE)[0]) > usual - 0.1


def test_of_states_reported_with_nine_tenths_nine_in_ten_are_right():
    _, reported = classified(seen(RATE), RATE)
    about = (reported[:, 0] > 0.85) & (reported[:, 0] < 0.95)
    assert about.sum() > 500 and reported[about, 1].mean() == pytest.approx(0.9, abs=0.06)


def test_confidence_of_a_state_of_slip_is_right_on_scenes_by_which_it_was_not_measured():
    """Of the states reported with little and with much confidence as many are right as that says."""
    seed, reported = 7300, []
    for scene, (origin, membrane, frames) in zip(measured(RATE, seed=seed), seen(RATE, seed=seed)):
        classifier, state = _core.DotClassifier(membrane, origin, border_network()), NONE
        for (xyz, true, _), truth in zip(frames, scene.truths):
            found = classifier.classify(np.arange(len(true)), xyz, 1 / RATE)
            touched = found.state > 0
            state = next_state(state, np.mean(found.state[touched] == 2)) if touched.any() else NONE
            if touched.any() and true.any():
                reported.append((slip_confidence(state, found.objects), state == truth.slip_state))
    stated, right = np.array([one for one in reported if np.isfinite(one[0])]).T
    for low, high in ((0.0, 0.5), (0.5, 0.7), (0.7, 1.0)):
        some = (stated >= low) & (stated < high)
        assert some.sum() < 30 or right[some].mean() == pytest.approx(stated[some].mean(), abs=0.15)
    assert right.mean() == pytest.approx(stated.mean(), abs=0.15)

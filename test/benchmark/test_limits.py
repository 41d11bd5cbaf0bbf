# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Halved and doubled constants of the detection of dots and of their ranges by colour, on images that are rendered once."""
from dataclasses import fields
from functools import lru_cache

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
import dots
import printed_dots
from fit_contact_score import KINDS, random_scene
from judged import touchpad_parameters
from tactile_driver.parameters.table import defaults
from tactile_perception import _core
from tactile_perception.dots.detect import LikelihoodDetector
from tactile_perception.dots.look import measure_look
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.parameters.touchpad import DOT_PARAMETERS
from tactile_perception.touchpad import water
from tactile_perception.touchpad.places import DotPlaces
from tactile_perception.touchpad.sensor import Touchpad

FACTORS = 0.5, 2.0
DOT_LIMITS = [name for name in dir(_core.dots.DotLimits) if not name.startswith('_')]
WATER_LIMITS = [field.name for field in fields(water.WaterLimits)]
RATE = 5.0  # frames/s
pytestmark = pytest.mark.full


@lru_cache(maxsize=1)
def printed():
    """Scenes of printed dots, a noisy image of each, its noise, and the look of its dots."""
    found = []
    for name, noise in (('plain', 2.0), ('compressed', 8.0), ('glare', 4.0), ('all at once', 2.0)):
        scene = printed_dots.make_scene(name, seed=31)
        image = scene.frame(noise, np.random.default_rng(31))
        found.append((scene, image, noise, measure_look(image, -1)))
    return found


def detected(limits):
    """1 - F1 of dots that neither overlap nor are under glare, and mean square of their errors over the least possible."""
    sums = [dots.score(scene, LikelihoodDetector(-1, look, limits).detect(image), noise) for scene, image, noise, look in printed()]
    matched, true, false, error2, bound2 = (sum(one[name] for one in sums) for name in ('matched', 'true', 'false', 'error2', 'bound2'))
    return np.array([1 - 2 * matched / (matched + true + false), error2 / bound2])


def changed(limits, name, factor):
    setattr(limits, name, factor * getattr(limits, name))
    return limits


def test_no_limit_of_dots_decides_alone():
    usual = detected(_core.dots.DotLimits())
    found = {(name, factor): detected(changed(_core.dots.DotLimits(), name, factor)) for name in DOT_LIMITS for factor in FACTORS}
    assert {which: errors for which, errors in found.items() if (errors > 1.25 * usual + [0.005, 0]).any()} == {}, usual


@pytest.mark.parametrize('pitch', [9.0, 36.0])
def test_dots_at_half_and_at_double_the_pitch_are_found_as_well(pitch):
    scene = printed_dots.make_scene('uneven light', seed=32, size=(round(35.6 * pitch), round(26.7 * pitch)), pitch=pitch)
    found = dots.score(scene, LikelihoodDetector(-1).detect(scene.frame(2.0, np.random.default_rng(32))), 2.0)
    assert found['matched'] > 0.99 * found['true'] and found['false'] < 5 and found['error2'] < 1.3 * found['bound2']


@lru_cache(maxsize=1)
def coloured():
    """Scenes with glare and without: sensor, camera, images, tracks of their dots, and true places."""
    found = []
    for kind, effect in (('disc', 1), ('ball', 4)):
        scene = random_scene(KINDS.index(kind) + effect * len(KINDS), 9300, RATE)
        values = {**defaults(DOT_PARAMETERS), **touchpad_parameters(scene)}
        sensor = Touchpad.from_parameters(values)
        tracker, frames = make_tracker(sensor, values), [scene.render(k / RATE) for k in range(scene.frames)]
        tracks = [tracker.process(frame.image, 1 + k / RATE) for k, frame in enumerate(frames)]
        found.append((sensor, sensor.camera(scene.camera.matrix, scene.camera.distortion), frames, tracks))
    return found


def placed():
    """Root mean square error of the places of all dots, m, with glare and without."""
    found = []
    for sensor, camera, frames, tracks in coloured():
        places, off = DotPlaces(sensor, camera), []
        for frame, seen in zip(frames, tracks):
            off.append(np.square(places.locate(frame.image, seen) - frame.truth.dot_xyz[seen.id]).sum(axis=1))
        found.append(np.sqrt(np.nanmean(np.concatenate(off))))
    return np.array(found)


def scaled(name, factor):
    """A limit so many times as large; of shares of a level, the distance from 1."""
    value = getattr(water.LIMITS, name)
    return 1 + factor * (value - 1) if name in ('ink', 'glare') else factor * value


def test_no_limit_of_colour_decides_alone(monkeypatch):
    usual, found = placed(), {}
    for name in WATER_LIMITS:
        for factor in FACTORS:
            with monkeypatch.context() as patch:
                patch.setattr(water.LIMITS, name, scaled(name, factor))
                found[name, factor] = placed()
    assert {which: errors for which, errors in found.items() if (errors > 1.5 * usual).any()} == {}, usual

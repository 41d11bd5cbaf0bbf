# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Drags of a tip over the simulated dome, from sticking to sliding skin, and two tips at once, told with the calibration that ships."""
from functools import partial

import numpy as np
import pytest
from tactile_bringup.installed import share
from tactile_driver.simulation.scene.specimen import Script, drag, one_after_the_other, press
from tactile_driver.simulation.sensors import scenes
from tactile_driver.simulation.sensors.air_cushion import air_cushion
from tactile_perception.press.calibration import read_touch
from tactile_perception.common.dots import DotTracks
from tactile_perception.press.methods import make_method
from tactile_perception.press.field import RestMarkers, view_maker
from tactile_perception.parameters.file import read_parameters
from tactile_perception.press.parameters import POINT_PARAMETERS, marker_sensor
from tactile_perception.touchpad.sensor import camera_pose

RATE, NOISE, WAY = 5.0, 0.02, (-0.021, 0.021)  # Hz, px, m
LARGEST = 1.2e-3, 2e-3, 1.1e-3  # m, mean and greatest error of place, mean error of depth of a drag. Chosen
OF_TWO, DEPTH_OF_TWO = 2.2e-3, 3e-3  # m, mean errors of place of the centres of two contacts, and of their depths. Chosen


def played(act, friction):
    """The true contacts and the told touches of each frame of an act."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(scenes.SCENES, 'one act', Script(air_cushion, one_after_the_other([act]), friction=friction))
        scene = scenes.open_scene('one act', rate=RATE)
    values = read_parameters(share('params', 'air_cushion_sim.yaml'), 'contact_point_node', POINT_PARAMETERS)
    sensor, known = marker_sensor(values), read_touch(share('calibration', 'air_cushion_sim.yaml'), 'air_cushion')
    make_view = view_maker(sensor, (scene.camera.matrix, scene.camera.distortion), None, camera_pose(values))
    rest, method, rng = RestMarkers(17 * 17, make_view), make_method(known.best, known.fitted(known.best), sensor), np.random.default_rng(0)
    still, frames = scene.observe(0).truth, []
    for k in range(scene.frames):
        truth = scene.observe(k).truth
        uv = truth.dot_uv + rng.normal(0, NOISE, truth.dot_uv.shape)
        tracks = DotTracks(17, 17, truth.dot_id.astype(np.int64), uv, np.full(len(uv), 100.0), np.full(len(uv), NOISE), uv - still.dot_uv)
        frames.append((truth.contacts, method.estimate(rest.field(tracks))))
    return frames


def dragged(friction):
    """The truth and the told touches of each frame of a drag by WAY, from the first frame in which the tip moves."""
    frames = played(partial(drag, 'ball_30mm', 0.02, -0.01, 0.022, *WAY, duration=2.0), friction)
    return [(truth[0], told) for truth, told in frames if truth and truth[0].position[0] < 0.02 - 1e-4 and truth[0].depth > 0.02]


@pytest.mark.parametrize('friction', [0.2, 0.35, 1.0])
def test_a_dragged_tip_is_told_as_one_where_it_is(friction):
    frames = dragged(friction)
    assert len(frames) > 8 and all(len(told) == 1 for _, told in frames)
    place = np.array([np.hypot(*(told[0].position - truth.position)[:2]) for truth, told in frames])
    depth = np.array([abs(told[0].depth - truth.depth) for truth, told in frames])
    assert place.mean() < LARGEST[0] and place.max() < LARGEST[1] and depth.mean() < LARGEST[2]
    assert np.mean(np.square(depth / [told[0].depth_sigma for _, told in frames])) < 2.0


@pytest.mark.parametrize('tip, friction', [('ball_22mm', 0.6), ('ball_42mm', 0.2), ('ball_42mm', 1.0)])
def test_errors_of_other_tips_with_other_frictions_are_as_stated(tip, friction):
    frames = played(partial(press, tip, 0.02, -0.025, 0.008, 0.016, 0.024, 0.032, move=0.4), friction)
    pairs = [(truth[0], told[0]) for truth, told in frames if truth and len(told) == 1 and truth[0].depth > 1e-3]
    assert len(pairs) > 12
    assert np.mean([((told.depth - truth.depth) / told.depth_sigma)**2 for truth, told in pairs]) < 2.0


def test_two_tips_of_half_the_calibrated_radius_are_told_as_two_where_and_as_deep_as_they_are():
    """Five radii apart; drags alone would end with hardly any depth and a long way."""
    frames = played(partial(press, 'fists_70mm', 0.0, 0.01, 0.010, 0.018, 0.026, move=0.4), 0.35)
    deep = [(truth, told) for truth, told in frames if len(truth) == 2 and truth[0].depth > 9.9e-3]  # not the retreat
    assert len(deep) > 5 and all(len(told) == 2 for _, told in deep)
    pairs = [(min(told, key=lambda touch: np.hypot(*(touch.position - tip.position)[:2])), tip) for truth, told in deep for tip in truth]
    assert np.mean([np.hypot(*(touch.position - tip.position)[:2]) for touch, tip in pairs]) < OF_TWO
    off = np.array([touch.depth - tip.depth for touch, tip in pairs])
    assert np.abs(off).mean() < DEPTH_OF_TWO
    assert np.mean(np.square(off / [touch.depth_sigma for touch, _ in pairs])) < 2.0

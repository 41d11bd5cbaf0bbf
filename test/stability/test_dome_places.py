# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Positions of the simulated dome's markers under a press against the simulation's truth, near and far from the touch."""
from functools import partial

import numpy as np
import pytest
from tactile_bringup.installed import share
from tactile_driver.simulation.scene.specimen import Script, one_after_the_other, press
from tactile_driver.simulation.sensors import scenes
from tactile_driver.simulation.sensors.air_cushion import air_cushion
from tactile_perception.press.calibration import read_touch
from tactile_perception.common.dots import DotTracks
from tactile_perception.press.methods import make_method
from tactile_perception.press.positions import DomePlaces
from tactile_perception.press.field import view_maker
from tactile_perception.parameters.file import read_parameters
from tactile_perception.press.parameters import POINT_PARAMETERS, marker_sensor
from tactile_perception.touchpad.sensor import camera_pose

DEPTH, AT_REST, PRESSED = 0.033, 0.5, 2.4  # m, s, s
NOISE = 0.05  # px


def tracks_of(truth, uv, rest_uv):
    count = len(uv)
    return DotTracks(17, 17, truth.dot_id.astype(np.int64), uv, np.full(count, 100.0), np.full(count, 0.02), uv - rest_uv)


@pytest.fixture(params=[(0.0, 0.0), (0.03, -0.02), (-0.04, 0.05)], ids=str, scope='module')
def pressed(request):
    """Places at rest and pressed, m, as estimated and as they are; distance from the touch, m."""
    place = request.param
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(scenes.SCENES, 'one press', Script(air_cushion, one_after_the_other([
            partial(press, 'ball_30mm', *place, DEPTH, move=0.5)])))
        scene = scenes.open_scene('one press', rate=10.0)
    values = read_parameters(share('params', 'air_cushion_sim.yaml'), 'contact_point_node', POINT_PARAMETERS)
    sensor, known = marker_sensor(values), read_touch(share('calibration', 'air_cushion_sim.yaml'), 'air_cushion')
    make_view = view_maker(sensor, (scene.camera.matrix, scene.camera.distortion), None, camera_pose(values))
    places = DomePlaces(sensor, 17 * 17, make_view, make_method(known.best, known.fitted(known.best), sensor))
    still, now = (scene.render(t).truth for t in (AT_REST, PRESSED))
    assert np.array_equal(still.dot_id, now.dot_id)
    rest = places.locate(None, tracks_of(still, still.dot_uv, still.dot_uv))
    seen = now.dot_uv + np.random.default_rng(0).normal(0, NOISE, now.dot_uv.shape)
    found = places.locate(None, tracks_of(now, seen, still.dot_uv))
    return rest, found, still.dot_xyz, now.dot_xyz, np.hypot(*(still.dot_xyz[:, :2] - place).T)


def test_markers_are_where_the_dent_takes_them(pressed):
    _, found, _, true, _ = pressed
    off = np.linalg.norm(found - true, axis=1)
    assert np.isfinite(off).all() and np.sqrt(np.mean(off**2)) < 1.5e-3


def test_markers_far_from_the_touch_move_as_the_gas_lets_them(pressed):
    rest, found, true_rest, true, distance = pressed
    far = distance > 0.09
    moved, truly = np.linalg.norm(found - rest, axis=1)[far], np.linalg.norm(true - true_rest, axis=1)[far]
    assert far.sum() > 50 and np.abs(moved - truly).max() < 1e-3 and np.median(truly) > 1e-3

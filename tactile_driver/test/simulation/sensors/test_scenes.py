# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.scene.specimen import UNTOUCHED
from tactile_driver.simulation.sensors.scenes import SCENES, open_dual_scene, open_scene
from tactile_driver.simulation.truth import GROSS, INCIPIENT


def test_unknown_scene_lists_the_known_ones():
    with pytest.raises(BadArgument, match='demo, disc_tilt, disc_twist'):
        open_scene('nowhere')


@pytest.mark.parametrize('arguments', [{'rate': 0}, {'rate': float('nan')}, {'width': 640, 'height': 640}, {'width': 100, 'height': 75}])
def test_bad_numbers_are_refused(arguments):
    with pytest.raises(BadArgument, match='simulation'):
        open_scene('rest', **arguments)


def test_every_scene_starts_untouched_and_ends_before_its_duration():
    for name, script in SCENES.items():
        starts = [keys[0].t for _, keys in script.acts]
        assert all(start >= UNTOUCHED for start in starts), name
        ends = [keys[-1].t for _, keys in script.acts]
        assert all(end <= start for end, start in zip(ends, starts[1:])), name
        assert all(keys[0].press < 0 and keys[-1].press < 0 for _, keys in script.acts), name


@pytest.fixture(scope='module')
def demo():
    scene = open_scene('demo', width=320, height=240)
    return scene, [scene.observe(k).truth for k in range(scene.frames)]


@pytest.mark.full
def test_demo_takes_half_a_minute_and_shows_all_that_it_promises(demo):
    scene, truths = demo
    assert 20 <= scene.duration <= 30
    assert (scene.rows, scene.columns) == (23, 23)
    touched = np.array([bool(truth.contacts) for truth in truths])
    assert np.diff(touched.astype(int)).clip(0).sum() == 5
    assert {INCIPIENT, GROSS} <= {truth.slip_state for truth in truths}
    assert any(len(truth.holes) == 1 for truth in truths)
    assert max(abs(truth.motion[5]) for truth in truths if truth.contacts) > 0.01


@pytest.mark.full
def test_demo_s_dots_stay_apart(demo):
    scene, truths = demo
    rest = truths[0].dot_uv.reshape(23, 23, 2)
    for truth in truths[::5]:
        grid = truth.dot_uv.reshape(23, 23, 2)
        for axis in (0, 1):
            apart = np.linalg.norm(np.diff(grid, axis=axis), axis=-1) / np.linalg.norm(np.diff(rest, axis=axis), axis=-1)
            assert apart.min() > 0.6


@pytest.mark.full
def test_calibration_presses_a_ball_at_known_places_and_depths():
    scene = open_scene('sphere_calibration', rate=10, width=320, height=240)
    presses = {}
    for k in range(scene.frames):
        for touch in scene.observe(k).truth.contacts:
            key = tuple(np.round(touch.position[:2] * 1e3, 1)), k // 11
            presses[key] = max(presses.get(key, 0), touch.depth)
    assert len({place for place, _ in presses}) == 9
    assert max(presses.values()) == pytest.approx(0.0045, abs=1e-4)


def test_rest_never_moves():
    scene = open_scene('rest', width=320, height=240)
    assert scene.duration == pytest.approx(10)
    assert scene.observe(250) is scene.observe(0)


def test_scenes_of_other_sensors_begin_with_their_type():
    for sensor in ('areal_single', 'areal_dual', 'air_cushion'):
        assert {f'{sensor}_{what}' for what in ('demo', 'rest', 'press', 'two', 'calibration', 'test')} <= set(SCENES)


def test_one_camera_and_two_are_opened_each_by_its_function():
    with pytest.raises(BadArgument, match='two cameras'):
        open_scene('areal_dual_rest')
    with pytest.raises(BadArgument, match='one camera; those with two are areal_dual_calibration'):
        open_dual_scene('demo')
    with pytest.raises(BadArgument, match='unknown'):
        open_dual_scene('nowhere')


@pytest.mark.parametrize('name', ['areal_single_rest', 'air_cushion_rest'])
def test_half_size_is_the_same_view(name):
    whole, half = (open_scene(name, width=width, height=width * 3 // 4).observe(0).truth.dot_uv for width in (640, 320))
    np.testing.assert_allclose((half + 0.5) * 2, whole + 0.5, atol=1e-9)

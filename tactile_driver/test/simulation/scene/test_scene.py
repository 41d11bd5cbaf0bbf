# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.scene.shutters import Shutters
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene


@pytest.fixture(scope='module')
def scene():
    return open_scene('impact', width=320, height=240)


def test_same_time_gives_the_same_frame_in_any_order(scene):
    times = [0.5, 1.9, 1.85, 0.0, 2.4]
    first = [scene.render(t) for t in times]
    again = open_scene('impact', width=320, height=240)
    for t, frame in sorted(zip(times, first), key=lambda pair: pair[0]):
        other = again.render(t)
        np.testing.assert_array_equal(other.image, frame.image)
        np.testing.assert_array_equal(other.truth.dot_uv, frame.truth.dot_uv)


def test_scene_repeats_but_its_noise_does_not(scene):
    early, late = scene.render(1.9), scene.render(1.9 + scene.duration)
    np.testing.assert_array_equal(early.truth.dot_xyz, late.truth.dot_xyz)
    assert (early.image != late.image).mean() > 0.2
    np.testing.assert_array_equal(scene.render_clean(1.9).image, scene.render_clean(1.9 + scene.duration).image)


def test_frames_computed_ahead_are_those_of_the_scene():
    ahead, plain = (open_scene('impact', 30.0, 0, 320, 240) for _ in range(2))
    assert sum(ahead.observe_ahead(9) for _ in range(20)) == 10 and not ahead.observe_ahead(9)
    while ahead.observe_ahead(10 * ahead.frames):
        pass
    deepest = int(np.argmax([-plain.observe(k).truth.wrench[2] for k in range(plain.frames)]))
    np.testing.assert_array_equal(ahead.observe(deepest).shape, plain.observe(deepest).shape)


def test_a_slow_camera_sees_the_same_presses():
    slow, quick = (open_scene('sphere_press', rate=rate, width=320, height=240) for rate in (3, 30))
    assert slow.frames * 10 == pytest.approx(quick.frames, abs=10)
    for k in range(slow.frames):
        pair = slow.observe(k).truth, quick.observe(10 * k).truth
        depth, other = (max([touch.depth for touch in truth.contacts], default=0.0) for truth in pair)
        assert depth == pytest.approx(other, abs=1e-6)


def test_a_fast_drag_slides_at_coulombs_friction():
    scene = open_dual_scene('areal_dual_fast_drag', shutters=Shutters(0.0))
    forces = np.array([scene.observe(k).truth.wrench[:3] for k in range(73, 88)])  # the first drag, at 80 mm/s
    ratios = np.hypot(forces[:, 0], forces[:, 1]) / -forces[:, 2]
    assert ratios.min() > 0.26 and ratios.max() < 0.39 and ratios.mean() == pytest.approx(0.35, abs=0.03)


@pytest.mark.parametrize('sign', [1, -1])
def test_right_camera_sees_the_tool_at_its_own_time(sign):
    scene = open_dual_scene('areal_dual_press', rate=10.0, shutters=Shutters(sign * 0.025))
    finer = open_dual_scene('areal_dual_press', rate=40.0, shutters=Shutters(0.0))
    for k in range(17, 22):
        late = finer.right_dot_uv(4 * k + sign)
        early = finer.right_dot_uv(4 * k)
        assert scene.right_delay(k) == sign * 0.025
        off = np.linalg.norm(scene.right_dot_uv(k) - late, axis=1).max()
        assert off < 0.35 + 0.3 * np.linalg.norm(early - late, axis=1).max()
    moved = np.linalg.norm(scene.right_dot_uv(19) - scene.right_dot_uv(17), axis=1).max()
    assert moved > 1.0


def test_two_views_are_the_same_for_the_same_time_in_any_order():
    scene, again = (open_dual_scene('areal_dual_press', rate=10.0, seed=1) for _ in range(2))
    first = [scene.render(t) for t in (2.3, 0.0, 1.9)]
    for t, pictures in zip((2.3, 1.9, 0.0), (first[0], first[2], first[1])):
        left, right, truth = again.render(t)
        np.testing.assert_array_equal(left, pictures[0])
        np.testing.assert_array_equal(right, pictures[1])
        np.testing.assert_array_equal(truth.dot_uv, pictures[2].dot_uv)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest

from sheets_seen import bright_spots

from tactile_driver.simulation.sensors.scenes import open_dual_scene


@pytest.fixture(scope='module')
def scene():
    return open_dual_scene('areal_dual_press', rate=20.0, seed=3)


def inside(uv, margin):
    return (uv > margin).all(axis=1) & (uv < np.array([480, 640]) - margin).all(axis=1)


def test_each_camera_sees_its_half_and_two_columns_are_in_both(scene):
    left, right, truth = scene.render(0)
    assert left.shape == right.shape == (640, 480, 3) and (scene.rows, scene.columns) == (11, 14)
    in_left, in_right = (inside(uv, 12).reshape(11, 14).all(axis=0) for uv in (truth.dot_uv, scene.right_dot_uv(0)))
    assert in_left.tolist() == [True] * 8 + [False] * 6 and in_right.tolist() == [False] * 6 + [True] * 8


@pytest.mark.parametrize('number', [0, 51])
def test_markers_are_seen_by_both_where_the_truth_says(scene, number):
    left, right, truth = scene.render_clean(number / scene.rate)
    for image, uv in ((left, truth.dot_uv), (right, scene.right_dot_uv(number))):
        seen = uv[inside(uv, 20)]
        off = np.linalg.norm(bright_spots(image, seen, 17)[0] - seen, axis=1)
        assert len(seen) >= 80 and np.median(off) < (0.2 if number == 0 else 0.3)


def test_cameras_are_turned_a_little_and_the_right_one_is_brighter(scene):
    left, right, truth = scene.render_clean(0)
    rows = [np.mean([np.arctan2(*(uv[k + 3] - uv[k])[::-1]) for k in starts])
            for uv, starts in ((truth.dot_uv, range(1, 154, 14)), (scene.right_dot_uv(0), range(8, 154, 14)))]
    assert 0.02 < abs(rows[0] - rows[1]) < 0.08
    shared = np.flatnonzero((np.arange(154) % 14 == 6) | (np.arange(154) % 14 == 7))
    bright = [image[tuple(np.round(uv[shared]).astype(int).T[::-1])][:, 1].astype(float).mean()
              for image, uv in ((left, truth.dot_uv), (right, scene.right_dot_uv(0)))]
    assert 1.05 < bright[1] / bright[0] < 1.4


def test_press_is_five_millimetres_deep_in_both_views(scene):
    truth = scene.observe(52).truth
    touch, = truth.contacts
    assert touch.position == pytest.approx([0.004, -0.008, -0.005], abs=1e-4) and 0.2 < touch.force < 1.5
    moved = [np.abs(uv(52) - uv(0)).max() for uv in (lambda k: scene.observe(k).truth.dot_uv, scene.right_dot_uv)]
    assert min(moved) > 8


def test_seed_makes_the_specimen(scene):
    same, other = (open_dual_scene('areal_dual_press', rate=20.0, seed=seed) for seed in (3, 4))
    for a, b in zip(same.render(0)[:2], scene.render(0)[:2]):
        np.testing.assert_array_equal(a, b)
    assert not np.array_equal(other.render(0)[0], scene.render(0)[0])
    assert 0.003 <= other.right_delay(0) <= 0.004 and other.right_delay(0) == other.right_delay(9) != scene.right_delay(0)

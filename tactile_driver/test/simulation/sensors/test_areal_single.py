# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest

from sheets_seen import bright_spots

from tactile_driver.simulation.sensors.scenes import open_scene


@pytest.fixture(scope='module')
def scene():
    return open_scene('areal_single_press', rate=20.0, seed=3)


@pytest.fixture(scope='module')
def deepest(scene):
    depths = [max([touch.depth for touch in scene.observe(k).truth.contacts], default=0.0) for k in range(scene.frames)]
    return int(np.argmax(depths))


def test_markers_are_seen_where_the_truth_says_at_rest_and_pressed(scene, deepest):
    for number, limit in ((0, 0.1), (deepest, 0.25)):
        image, uv = scene.render_clean(number / scene.rate).image, scene.observe(number).truth.dot_uv
        found, _ = bright_spots(image, uv, 13)
        off = np.linalg.norm(found - uv, axis=1)
        assert np.median(off) < limit and np.percentile(off, 95) < 4 * limit


def test_press_has_a_tip_a_depth_and_a_force_in_balance(scene, deepest):
    truth = scene.observe(deepest).truth
    touch, = truth.contacts
    assert touch.position == pytest.approx([0.007, -0.005, -0.010], abs=2e-6) and touch.depth == pytest.approx(0.010, abs=2e-6)
    assert truth.wrench[2] == pytest.approx(-touch.force, rel=0.02) and 0.5 < touch.force < 3
    assert np.cross(touch.position, truth.wrench[:3])[:2] == pytest.approx(truth.wrench[3:5], abs=0.05 * touch.force * 0.0085)
    assert truth.centroid[:2] == pytest.approx([0.007, -0.005], abs=0.5e-3) and 1e-5 < truth.area < 1e-4
    lowest = truth.dot_xyz[truth.dot_xyz[:, 2].argmin()]
    assert np.linalg.norm(lowest[:2] - [0.007, -0.005]) < 0.0035 and -0.010 < lowest[2] < -0.0085


def test_seeds_are_other_specimens_and_the_same_seed_the_same(scene):
    same, other = (open_scene('areal_single_press', rate=20.0, seed=seed).render(0) for seed in (3, 4))
    np.testing.assert_array_equal(same.image, scene.render(0).image)
    off = other.truth.dot_uv - same.truth.dot_uv
    assert 1 < np.linalg.norm(off, axis=1).mean() < 15 and off.std(axis=0).min() > 0.3


def test_of_two_fingertips_each_is_where_it_touches_a_sheet_that_the_other_inclines():
    """Away from the other by some part of the radius, and higher than its lowest point."""
    scene = open_scene('areal_single_two', rate=4.0)
    pairs = (scene.observe(k).truth.contacts for k in range(scene.frames))
    first, second = pair = next(pair for pair in pairs if pair and pair[0].depth > 5.9e-3)
    apart = np.hypot(*(first.position - second.position)[:2])
    assert 0.023 + 1e-4 < apart < 0.023 + 2e-3
    assert all(-contact.depth + 1e-4 < contact.position[2] < -contact.depth + 2e-3 for contact in pair)


def test_of_two_unlike_fingertips_one_moves():
    scene = open_scene('areal_single_two_unlike', rate=8.0)
    pairs = [[(c.position, c.depth) for c in scene.observe(k).truth.contacts] for k in range(scene.frames)]
    pairs = np.array([[np.append(*contact) for contact in pair] for pair in pairs[:len(pairs) // 2] if len(pair) == 2])
    still, moved = (np.ptp(pairs[8:16, k, :2], axis=0).max() for k in (0, 1))
    assert still < 5e-4 and moved > 1.5e-3 and pairs[10, 1, 3] > pairs[10, 0, 3] + 1.5e-3

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated sensors with cameras."""

from functools import partial

import numpy as np
import pytest
from sheets_seen import bright_spots
from tactile_driver.errors import BadArgument
from tactile_driver.simulation.scene.specimen import UNTOUCHED, Script, one_after_the_other, press
from tactile_driver.simulation.sensors import scenes
from tactile_driver.simulation.sensors.air_cushion import air_cushion
from tactile_driver.simulation.sensors.scenes import SCENES, open_dual_scene, open_scene


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


def test_one_camera_and_two_are_opened_each_by_its_function():
    with pytest.raises(BadArgument, match='two cameras'):
        open_scene('areal_dual_rest')
    with pytest.raises(BadArgument, match='one camera; those with two are areal_dual_calibration'):
        open_dual_scene('demo')
    with pytest.raises(BadArgument, match='unknown'):
        open_dual_scene('nowhere')


@pytest.fixture(scope='module')
def scene():
    return open_scene('areal_single_press', rate=20.0, seed=3)


@pytest.fixture(scope='module')
def deepest(scene):
    depths = [max([touch.depth for touch in scene.observe(k).truth.contacts], default=0.0) for k in range(scene.frames)]
    return int(np.argmax(depths))


def test_markers_are_seen_where_the_truth_says_at_rest_and_pressed(scene, deepest):
    for number, limit in ((0, 0.1), (deepest, 0.25)):
        image, uv = scene.render(number / scene.rate).image, scene.observe(number).truth.dot_uv
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


def test_of_two_fingertips_each_is_where_it_touches_a_sheet_that_the_other_inclines():
    """Away from the other by some part of the radius, and higher than its lowest point."""
    scene = open_scene('areal_single_two', rate=4.0)
    pairs = (scene.observe(k).truth.contacts for k in range(scene.frames))
    first, second = pair = next(pair for pair in pairs if pair and pair[0].depth > 5.9e-3)
    apart = np.hypot(*(first.position - second.position)[:2])
    assert 0.023 + 1e-4 < apart < 0.023 + 2e-3
    assert all(-contact.depth + 1e-4 < contact.position[2] < -contact.depth + 2e-3 for contact in pair)


@pytest.fixture(scope='module')
def scene_areal():
    return open_dual_scene('areal_dual_press', rate=20.0, seed=3)


def inside(uv, margin):
    return (uv > margin).all(axis=1) & (uv < np.array([480, 640]) - margin).all(axis=1)


@pytest.mark.parametrize('number', [0, 51])
def test_markers_are_seen_by_both_where_the_truth_says(scene_areal, number):
    left, right, truth = scene_areal.render(number / scene_areal.rate)
    for image, uv in ((left, truth.dot_uv), (right, scene_areal.right_dot_uv(number))):
        seen = uv[inside(uv, 20)]
        off = np.linalg.norm(bright_spots(image, seen, 17)[0] - seen, axis=1)
        assert len(seen) >= 80 and np.median(off) < (0.2 if number == 0 else 0.3)


def test_seed_makes_the_specimen(scene_areal):
    same, other = (open_dual_scene('areal_dual_press', rate=20.0, seed=seed) for seed in (3, 4))
    for a, b in zip(same.render(0)[:2], scene_areal.render(0)[:2]):
        np.testing.assert_array_equal(a, b)
    assert not np.array_equal(other.render(0)[0], scene_areal.render(0)[0])
    assert 0.003 <= other.right_delay(0) <= 0.004 and other.right_delay(0) == other.right_delay(9) != scene_areal.right_delay(0)


@pytest.fixture(scope='module')
def cushion():
    return open_scene('air_cushion_press', rate=20.0, seed=3)


@pytest.fixture(scope='module')
def deepest_air(cushion):
    return int(np.argmax([max([touch.depth for touch in cushion.observe(k).truth.contacts], default=0.0) for k in range(cushion.frames)]))


def test_circles_are_a_grid_without_corners_and_all_in_the_picture(cushion):
    truth = cushion.render(0).truth
    assert (cushion.rows, cushion.columns, cushion.sensor) == (17, 17, 'air_cushion')
    assert 0 not in truth.dot_id and 8 * 17 + 8 in truth.dot_id and 200 < len(truth.dot_id) < 240
    assert truth.dot_uv.min() > 8 and (truth.dot_uv < [632, 472]).all()
    assert cushion.membrane.rest[..., 2].max() == pytest.approx(0.120, abs=1e-4)
    assert np.hypot(*cushion.membrane.rim(60)[:, :2].T) == pytest.approx(0.150, abs=1e-6)


def test_circles_are_seen_where_the_truth_says(cushion, deepest_air):
    for number in (0, deepest_air):
        image, uv = cushion.render(number / cushion.rate).image, cushion.observe(number).truth.dot_uv
        found, _ = bright_spots(image, uv, 9)
        assert np.median(np.linalg.norm(found - uv, axis=1)) < 0.25


@pytest.mark.full
def test_a_press_hardly_depends_on_the_frames_it_is_seen_in(monkeypatch):
    """Friction depends on the path: a tip that goes far in one step of contact would touch the skin too late."""
    act = partial(press, 'ball_30mm', 0.03, -0.02, 0.035, move=0.5, hold=1.0)
    monkeypatch.setitem(scenes.SCENES, 'one press', Script(air_cushion, one_after_the_other([act], untouched=0.0)))
    places = []
    for rate in (2.0, 40.0):
        seen = open_scene('one press', rate=rate, seed=3)
        number = max(range(seen.frames), key=lambda k: max([touch.depth for touch in seen.observe(k).truth.contacts], default=0.0))
        places.append(seen.observe(number).truth.dot_xyz)
    assert np.linalg.norm(places[0] - places[1], axis=1).max() < 1.5e-4


def test_gas_is_compressed_and_carries_the_indenter(cushion, deepest_air):
    rest, truth = cushion.observe(0).truth, cushion.observe(deepest_air).truth
    touch, = truth.contacts
    assert touch.depth == pytest.approx(0.035, abs=1e-5) and touch.position[:2] == pytest.approx([0.030, -0.020], abs=1e-5)
    assert 1.02 < truth.pressure / rest.pressure < 1.4
    assert touch.force == pytest.approx(-truth.wrench[:3] @ truth.normal) and 5 < touch.force < 20
    # what presses on the contact's area, and the skin's pull at its edge
    assert touch.force > 0.8 * truth.pressure * truth.area
    volume = cushion.membrane.volume_of(cushion.observe(deepest_air).shape.astype(float))
    lost = 1 - volume / cushion.membrane.volume
    assert lost == pytest.approx((truth.pressure - rest.pressure) / (101325 + rest.pressure), rel=0.05)


@pytest.mark.parametrize('name, opened', [('areal_single_plate', open_scene), ('areal_dual_plate', open_dual_scene)])
def test_a_plate_holds_all_markers_at_its_depth_and_is_reported_without_force(name, opened):
    scene = opened(name, rate=2.0)
    truth = scene.observe(7).truth
    assert truth.contacts[0].depth == pytest.approx(3e-3) and np.isnan(truth.contacts[0].force) and np.isnan(truth.wrench).all()
    assert truth.dot_xyz[:, 2] == pytest.approx(-3e-3, abs=0.1e-3) and (truth.dot_state == 1).all()
    assert not scene.observe(0).truth.contacts

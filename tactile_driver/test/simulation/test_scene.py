# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Scenes and their truth, and the sensors that have them."""
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.constants import SIMULATION
from tactile_driver.simulation.scene.observe import Observer, find_region
from tactile_driver.simulation.scene.specimen import TIMING, Script, Shutters, one_after_the_other, press
from tactile_driver.simulation.sensors import scenes
from tactile_driver.simulation.sensors.air_cushion import air_cushion
from tactile_driver.simulation.sensors.areal_dual import areal_dual
from tactile_driver.simulation.sensors.scenes import SCENES, open_dual_scene, open_scene
from tactile_driver.simulation.sensors.touchpad import touchpad_camera, touchpad_dots
from tactile_driver.simulation.skin.contact import FrictionalContact
from tactile_driver.simulation.skin.surfaces import Membrane
from tactile_driver.simulation.skin.tools import TOOLS, Key, Motion
from tactile_driver.simulation.truth import GROSS, INCIPIENT, NO_SLIP, NON_CONTACT, SLIPPING, STICKING


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=49)


def pressed(membrane, name, depth, x=0.0):
    """State, tool and pose of a tool that was pressed straight down."""
    motion = Motion(TOOLS[name], [Key(0, x=x, press=0), Key(0.5, x=x, press=depth)], membrane)
    contact = FrictionalContact(membrane, 0.4)
    for k in range(15):
        state = contact.step(motion.tool, motion.pose(k / 30), motion.pose((k + 1) / 30))
    return state, motion.tool, motion.pose(0.5)


def test_ring_pressed_hard_is_touched_all_round(membrane):
    region = find_region(membrane, *pressed(membrane, 'ring', 0.003))
    assert len(region.outlines) == 1 and len(region.holes) == 1
    outer, inner = (np.hypot(*line[0][:, :2].T) for line in (region.outlines, region.holes))
    assert outer.mean() == pytest.approx(0.0075, abs=0.3e-3) and inner.mean() == pytest.approx(0.0045, abs=0.3e-3)
    assert outer.std() < 0.15e-3 and inner.std() < 0.15e-3
    assert region.area == pytest.approx(np.pi * (0.0075**2 - 0.0045**2), rel=0.15)
    assert region.centroid[:2] == pytest.approx([0, 0], abs=1e-4)
    assert region.normal == pytest.approx([0, 0, 1], abs=0.01)


def test_region_on_a_ball_is_round_about_its_tip(membrane):
    region = find_region(membrane, *pressed(membrane, 'sphere', 0.004))
    radius = np.hypot(*(region.outlines[0][:, :2] - region.centroid[:2]).T)
    assert region.centroid[:2] == pytest.approx([0, 0], abs=1e-4)
    assert radius.std() < 0.2e-3 and 0.003 < radius.mean() < 0.0065
    gap = np.linalg.norm(region.outlines[0] - [0, 0, 0.021 - 0.004], axis=1) - 0.008
    assert np.abs(gap).max() < 60e-6


FRICTION, RATE = 0.35, 30


def run(name, keys):
    """Truths, states and poses of a tool that goes through keys, frame by frame."""
    membrane, camera = Membrane(nodes=49), touchpad_camera()
    motion = Motion(TOOLS[name], keys, membrane)
    contact = FrictionalContact(membrane, FRICTION)
    observer = Observer(membrane, touchpad_dots(membrane, np.random.default_rng(0)), camera, 1 / RATE)
    out = []
    for k in range(int(keys[0].t * RATE), int(keys[-1].t * RATE)):
        before, now = motion.pose(k / RATE), motion.pose((k + 1) / RATE)
        state = contact.step(motion.tool, before, now)
        out.append((observer.observe(state, motion.tool, before, now).truth, state, now))
    return membrane, camera, motion, out


@pytest.fixture(scope='module')
def drag():
    return run('rectangle', [Key(0, press=-0.001), Key(0.8, press=0.0032), Key(1.2, press=0.0032), Key(3.0, x=0.0055, press=0.0032),
                             Key(3.4, x=0.0055, press=0.0032)])


@pytest.fixture(scope='module')
def twist():
    return run('disc', [Key(0, x=0.001, press=0.0), Key(0.6, x=0.001, press=0.003), Key(2.0, x=0.001, press=0.003, yaw=0.7)])


@pytest.fixture(scope='module')
def balls():
    return run('two_spheres', [Key(0, press=0.0), Key(0.6, press=0.0034), Key(0.8, press=0.0034)])


@pytest.fixture(scope='module')
def two_objects():
    pressed = Key(0.6, press=0.0034)
    return run('two_spheres', [Key(0, press=0.0), pressed, replace(pressed, t=0.8), replace(pressed, t=1.8, other_y=-0.004)])


def test_one_of_two_objects_is_dragged_until_it_slips_and_the_other_rests(two_objects):
    membrane, _, _, frames = two_objects
    truth = frames[-3][0]
    touched, right = truth.dot_state != NON_CONTACT, truth.dot_xyz[:, 0] > 0
    assert (truth.dot_state[touched & ~right] == STICKING).mean() > 0.8 and (truth.dot_state[touched & right] == SLIPPING).mean() > 0.5
    y = sorted((contact.position[0], contact.position[1]) for contact in truth.contacts)
    assert abs(y[0][1]) < 1e-6 and y[1][1] == pytest.approx(-0.004, abs=0.5e-3)


def test_membrane_s_rim_and_water_carry_the_wrench(drag):
    membrane, _, _, frames = drag
    truth, state, _ = frames[33]
    pull = membrane.springs.T @ np.ones(membrane.inner.sum())
    flat = state.shape.reshape(-1, 3)
    # what the rim's springs and the water do to the free skin balances the tool, up to the solver's residual
    springs = pull @ (flat - membrane.rest.reshape(-1, 3))
    pressed, resting = (membrane.area_vectors(shape)[membrane.inner].sum(axis=0) for shape in (state.shape, membrane.rest))
    water = state.pressure * pressed - membrane.pressure * resting
    np.testing.assert_allclose(springs - water, truth.wrench[:3], atol=0.003 * np.linalg.norm(truth.wrench[:3]))


def test_drag_sticks_then_slips_in_part_then_altogether(drag):
    states = [truth.slip_state for truth, _, _ in drag[3]]
    assert set(states[28:36]) == {NO_SLIP}
    assert INCIPIENT in states[36:]
    assert states[80:88] == [GROSS] * 8
    assert states.index(INCIPIENT) < states.index(GROSS)
    assert states[-5:] == [NO_SLIP] * 5
    for truth, _, _ in drag[3]:
        assert truth.slip_state == (NO_SLIP if truth.slipping_fraction < 0.05 else INCIPIENT if truth.slipping_fraction < 0.9 else GROSS)


def test_a_dot_slips_when_it_moves_over_the_tool(drag):
    _, _, _, frames = drag
    limit = SIMULATION.slip_speed / RATE
    for (first, _, before), (second, _, now) in zip(frames[40:85], frames[41:86]):
        both = (first.dot_state > 0) & (second.dot_state > 0)
        displacement = now.to_tool(second.dot_xyz) - before.to_tool(first.dot_xyz)
        along = np.linalg.norm(displacement[both][:, :2], axis=1)
        clear = np.abs(along - limit) > 0.05 * limit
        face = np.abs(now.to_tool(second.dot_xyz)[both][:, 2]) < 1e-6
        np.testing.assert_array_equal((second.dot_state[both] == SLIPPING)[clear & face], (along > limit)[clear & face])


def test_object_over_the_skin_is_still_while_it_sticks_and_goes_with_the_object_in_gross_slip(drag):
    assert (drag[3][30][0].velocity == 0).all()
    gross = [truth for truth, _, _ in drag[3][60:85] if truth.slipping_fraction == 1]
    assert len(gross) > 8
    # the median: now and then a row of nodes leaves the tool and the skin snaps back
    assert np.median([truth.velocity[0] for truth in gross]) == pytest.approx(0.0055 / 1.8 / 0.85, rel=0.15)
    for truth in gross:
        assert np.abs(truth.velocity[1]) < 1e-4 and np.isnan(truth.rotation_center).all()


def test_twist_turns_about_its_axis_and_makes_a_moment(twist):
    truth = twist[3][45][0]
    assert truth.velocity[5] == pytest.approx(0.7 / 1.4 / 0.85, rel=0.05)
    assert truth.velocity[:2] == pytest.approx([0, -0.001 * truth.velocity[5]], abs=4e-4)
    assert truth.rotation_center[:2] == pytest.approx([0.001, 0], abs=0.5e-3)
    assert truth.wrench[5] > 2e-4
    assert truth.motion[5] == pytest.approx(0.7 / 1.4 / 0.85 / RATE, rel=0.01)
    truth = next(truth for truth, _, _ in twist[3] if truth.slip_state == INCIPIENT and truth.slipping_fraction > 0.4)
    inner = np.linalg.norm(truth.dot_xyz[:, :2] - [0.001, 0], axis=1)
    assert inner[truth.dot_state == STICKING].mean() < inner[truth.dot_state == SLIPPING].mean()


def test_two_balls_are_two_touches(balls):
    truth = balls[3][-1][0]
    assert len(truth.contacts) == 2 and len(truth.outlines) == 2
    left, right = truth.contacts
    assert left.depth - right.depth == pytest.approx(0.0004, abs=2e-6)
    assert left.position[:2] == pytest.approx([-0.0065, 0]) and right.position[:2] == pytest.approx([0.0065, 0])
    assert left.force > right.force > 0.1
    assert left.force * left.normal[2] + right.force * right.normal[2] == pytest.approx(-truth.wrench[2], rel=0.05)
    for touch in truth.contacts:
        assert np.linalg.norm(touch.normal) == pytest.approx(1) and touch.normal[2] > 0.8


def test_of_two_unlike_balls_one_that_hardly_presses_is_where_it_touches():
    """Its pressure is all below half of the usual one, so that it has no region."""
    sensor, tool = areal_dual(0), TOOLS['fingers_6_and_12mm_42mm']
    motion = Motion(tool, [Key(0, press=0.0), Key(1.0, press=0.002)], sensor.skin)
    contact, (before, now) = FrictionalContact(sensor.skin, FRICTION), (motion.pose(0.5), motion.pose(1.0))
    contact.step(tool, motion.pose(0.0), before)
    state = contact.step(tool, before, now)
    nodes = state.shape.reshape(-1, 3)[sensor.skin.inner][state.touching]
    few, large = np.hypot(nodes[:, 0] - 0.021, nodes[:, 1]) < 5e-4, nodes[:, 0] > 0
    state.force[large] *= 0.05
    state = replace(state, touching=state.touching[few | ~large], force=state.force[few | ~large])
    observer = Observer(sensor.skin, sensor.pattern, sensor.cameras[0], 1 / RATE)
    large = observer.observe(state, tool, before, now).truth.contacts[1]
    assert large.depth == pytest.approx(0.002, abs=2e-6) and large.position[:2] == pytest.approx([0.021, 0], abs=1e-3)
    assert -large.depth - 1e-4 < large.position[2] < -large.depth + 1e-3


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


@pytest.mark.full
def test_a_fast_drag_slides_at_coulombs_friction():
    scene = open_dual_scene('areal_dual_fast_drag', shutters=Shutters(0.0))
    forces = np.array([scene.observe(k).truth.wrench[:3] for k in range(73, 88)])  # the first drag, at 80 mm/s
    ratios = np.hypot(forces[:, 0], forces[:, 1]) / -forces[:, 2]
    assert ratios.min() > 0.26 and ratios.max() < 0.39 and ratios.mean() == pytest.approx(0.35, abs=0.03)


@pytest.mark.full
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


def bright_spots(image, uv, half):
    """Centroids (K, 2) px of bright dots near positions uv (K, 2) px, in boxes of 2 half + 1 px, measured as simply as can be."""
    green = image[..., 1].astype(float)
    positions = []
    for u, v in np.round(uv).astype(int):
        box = green[v - half:v + half + 1, u - half:u + half + 1]
        low, high = np.percentile(box, 10), np.percentile(box, 95)
        share = np.clip((box - low) / (high - low), 0, 1)
        share[share < 0.15] = 0
        y, x = np.mgrid[v - half:v + half + 1, u - half:u + half + 1]
        positions.append([(share * x).sum() / share.sum(), (share * y).sum() / share.sum()])
    return np.array(positions)


def test_unknown_scene_lists_the_known_ones():
    with pytest.raises(BadArgument, match='rectangle_drag, disc_twist, disc_tilt'):
        open_scene('nowhere')


@pytest.mark.parametrize('arguments', [{'rate': 0}, {'rate': float('nan')}, {'width': 640, 'height': 640}, {'width': 100, 'height': 75}])
def test_bad_numbers_are_refused(arguments):
    with pytest.raises(BadArgument, match='simulation'):
        open_scene('rest', **arguments)


def test_every_scene_starts_untouched_and_ends_before_its_duration():
    for name, script in SCENES.items():
        starts = [keys[0].t for _, keys in script.acts]
        assert all(start >= TIMING.untouched for start in starts), name
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
def sheet():
    return open_scene('areal_single_press', rate=20.0, seed=3)


@pytest.fixture(scope='module')
def deepest(sheet):
    depths = [max([touch.depth for touch in sheet.observe(k).truth.contacts], default=0.0) for k in range(sheet.frames)]
    return int(np.argmax(depths))


def test_markers_are_seen_where_the_truth_says_at_rest_and_pressed(sheet, deepest):
    for number, limit in ((0, 0.1), (deepest, 0.25)):
        image, uv = sheet.render(number / sheet.rate).image, sheet.observe(number).truth.dot_uv
        found = bright_spots(image, uv, 13)
        off = np.linalg.norm(found - uv, axis=1)
        assert np.median(off) < limit and np.percentile(off, 95) < 4 * limit


def test_press_has_a_tip_a_depth_and_a_force_in_balance(sheet, deepest):
    truth = sheet.observe(deepest).truth
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
def pair_scene():
    return open_dual_scene('areal_dual_press', rate=20.0, seed=3)


def inside(uv, margin):
    return (uv > margin).all(axis=1) & (uv < np.array([480, 640]) - margin).all(axis=1)


@pytest.mark.parametrize('number', [0, 51])
def test_markers_are_seen_by_both_where_the_truth_says(pair_scene, number):
    left, right, truth = pair_scene.render(number / pair_scene.rate)
    for image, uv in ((left, truth.dot_uv), (right, pair_scene.right_dot_uv(number))):
        seen = uv[inside(uv, 20)]
        off = np.linalg.norm(bright_spots(image, seen, 17) - seen, axis=1)
        assert len(seen) >= 80 and np.median(off) < (0.2 if number == 0 else 0.3)


def test_seed_makes_the_specimen(pair_scene):
    same, other = (open_dual_scene('areal_dual_press', rate=20.0, seed=seed) for seed in (3, 4))
    for a, b in zip(same.render(0)[:2], pair_scene.render(0)[:2]):
        np.testing.assert_array_equal(a, b)
    assert not np.array_equal(other.render(0)[0], pair_scene.render(0)[0])
    assert 0.003 <= other.right_delay(0) <= 0.004 and other.right_delay(0) == other.right_delay(9) != pair_scene.right_delay(0)


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
        found = bright_spots(image, uv, 9)
        assert np.median(np.linalg.norm(found - uv, axis=1)) < 0.25


@pytest.mark.full
def test_a_press_hardly_depends_on_the_frames_it_is_seen_in(monkeypatch):
    """Friction depends on the path: a tip that goes far in one step of contact would touch the skin too late."""
    act = partial(press, 'ball_30mm', 0.03, -0.02, 0.035, move=0.5, hold=1.0)
    monkeypatch.setitem(scenes.SCENES, 'one press', Script(air_cushion, one_after_the_other([act], untouched=0.0)))
    positions = []
    for rate in (2.0, 40.0):
        seen = open_scene('one press', rate=rate, seed=3)
        number = max(range(seen.frames), key=lambda k: max([touch.depth for touch in seen.observe(k).truth.contacts], default=0.0))
        positions.append(seen.observe(number).truth.dot_xyz)
    assert np.linalg.norm(positions[0] - positions[1], axis=1).max() < 1.5e-4


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

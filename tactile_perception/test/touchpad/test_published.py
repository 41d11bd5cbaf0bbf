# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.common.geometry import rotation_matrix
from tactile_perception.published.touchpad_contact_region import PaperRegion
from tactile_perception.touchpad.pose import ObjectPose, RigidMotion, StickingReference, fit_rigid


def press(region, pad, frames, radius=6e-3):
    """A flat disc that moves into the pad by 0.3 mm a frame, with the dots that it reaches."""
    for k in range(frames):
        height = pad.cap.height - 0.3e-3 * k
        dots = pad.disc(radius=min(radius, np.sqrt(max(0.02**2 - (height - pad.cap.centre_z)**2, 1e-12))), height=height)
        states = region.process(dots.ids, dots.xyz, pad.rest, k / 30)
    return dots, states


def test_finds_a_pressed_disc_and_its_motion(pad):
    dots, states = press(PaperRegion(23, 23), pad, 12)
    found, true = states.state > 0, dots.score > 0.5
    assert 2 * (found & true).sum() / (found.sum() + true.sum()) > 0.75
    assert states.interval == pytest.approx(4 / 30)  # 4 frames are the first to exceed 0.91 mm
    middle = np.array([0, 0, 10e-3])
    np.testing.assert_allclose(states.motion.rotation @ middle + states.motion.translation - middle, [0, 0, -1.2e-3], atol=1e-6)


def test_states_persist_while_held_and_end_on_release(pad):
    region = PaperRegion(23, 23)
    dots, last = press(region, pad, 12)
    for k in range(12, 40):
        held = region.process(dots.ids, dots.xyz, pad.rest, 0.5 * k)
    assert (held.state > 0).sum() >= 0.9 * (last.state > 0).sum()
    assert not region.process(pad.ids, pad.rest, pad.rest, 30.0).state.any()


def test_equation_7_holds_for_a_rotating_object(pad):
    region = PaperRegion(23, 23)
    dots = pad.disc(height=10.5e-3)
    region.process(pad.ids, pad.rest, pad.rest, 0.0)
    region.process(dots.ids, dots.xyz, pad.rest, 0.1)
    touched = dots.score > 0.5
    moved = dots.xyz.copy()
    moved[touched] = moved[touched] @ rotation_matrix([0, 0, 0.3]).T + [0, 0, -0.6e-3]
    states = region.process(dots.ids, moved, pad.rest, 0.2)
    assert (states.state[touched] == 1).all()
    np.testing.assert_allclose(states.motion.rotation, rotation_matrix([0, 0, 0.3]), atol=1e-9)


def test_dots_that_slide_along_the_surface_are_separated(pad):
    region = PaperRegion(23, 23)
    dots, _ = press(region, pad, 12)
    touched = dots.score > 0.5
    moved = dots.xyz.copy()
    moved[touched] += [1.5e-3, 0, 0]
    slow = touched & (dots.xyz[:, 0] < -2e-3)
    moved[slow] -= [0.6e-3, 0, 0]
    region._past.clear()
    region.process(dots.ids, dots.xyz, pad.rest, 0.5)
    states = region.process(dots.ids, moved, pad.rest, 0.6).state
    assert np.mean(states[slow] == 2) > 0.7
    assert np.mean(states[touched & ~slow] == 1) > 0.7


def test_missing_dots_keep_their_state(pad):
    region = PaperRegion(23, 23)
    dots, last = press(region, pad, 10)
    half = np.arange(0, 529, 2)
    lower = dots.xyz - [0, 0, 0.3e-3] * (dots.score > 0.5)[:, None]
    partly = region.process(half, lower[half], pad.rest[half], 10 / 30)
    assert len(partly.state) == len(half)
    assert np.mean(partly.state == last.state[half]) > 0.9
    assert not len(region.process(np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3)), 11 / 30).state)


@pytest.mark.parametrize('name, least', [('tp_rect_drag', 0.75), ('tp_disc_twist', 0.85), ('tp_ring_press', 0.35)])
def test_recordings_with_noise_of_20_um(recording, name, least):
    truth, region, counts, rng = recording(name), PaperRegion(23, 23), np.zeros(3), np.random.default_rng(0)
    for k, stamp in enumerate(truth['timestamps']):
        ids = np.flatnonzero(truth['visible'][k])
        xyz = truth['dot_xyz'][k][ids] + rng.normal(0, 20e-6, (len(ids), 3))
        found = region.process(ids, xyz, truth['dot_rest_xyz'][ids], stamp).state > 0
        there, clear = truth['dot_contact'][k][ids], truth['dot_gap'][k][ids] > 50e-6
        counts += [(found & there).sum(), (found & ~there & clear).sum(), (~found & there).sum()]
    assert 2 * counts[0] / (2 * counts[0] + counts[1] + counts[2]) > least


@pytest.mark.parametrize('angle', [0.0, 1e-9, 1e-4, 0.3, 3.0])
def test_a_motion_is_found_unless_the_points_do_not_determine_it(angle):
    turn, p = rotation_matrix(angle * np.array([2, -1, 2]) / 3), np.random.default_rng(0).uniform(-4e-3, 4e-3, (40, 3))
    fit = fit_rigid(p, p @ turn.T + [1e-3, 0, -2e-3])
    np.testing.assert_allclose(fit.rotation, turn, atol=1e-12)
    np.testing.assert_allclose(fit.translation, [1e-3, 0, -2e-3], atol=1e-14)
    for open_ones in (p[:2], np.ones((5, 3)), np.outer(np.arange(5), [1e-3, 2e-3, 0])):
        assert fit_rigid(open_ones, open_ones) is None and fit_rigid(p[:len(open_ones)], open_ones) is None


def followed(frames, bias, lost=None):
    """Tilt, rad, of an object at rest after some frames with noisy dots and motions that tilt by bias, rad; from frame lost on, other dots
    stick."""
    rng, reference, tilt = np.random.default_rng(5), StickingReference(), np.eye(3)
    dots = np.column_stack([*(part.ravel() for part in np.meshgrid(*2 * [np.linspace(-5e-3, 5e-3, 6)])), np.full(36, 0.012)])
    for k in range(frames):
        sticks = np.arange(36) < 20 if lost is None or k < lost else np.arange(36) >= 16
        motion = RigidMotion(rotation=rotation_matrix(np.array([bias, 0.0, 0.0])), translation=np.zeros(3))
        tilt = reference.corrected(dots + rng.normal(0, 2e-5, dots.shape), sticks, motion).rotation @ tilt
    return np.arccos(np.clip(0.5 * (np.trace(tilt) - 1), -1, 1))


def test_errors_of_motions_do_not_add_up_while_the_same_dots_stick():
    assert followed(400, 1e-4) < 0.008 < 400 * 1e-4
    assert followed(400, 1e-4, lost=200) < 0.012, 'two starts'


def test_a_motion_is_that_of_the_dots_where_they_agree_with_it():
    turned = rotation_matrix(np.array([0.0, 0.01, 0.02]))
    dots = np.random.default_rng(1).normal(0, 5e-3, (30, 3))
    reference, sticks = StickingReference(), np.arange(30) < 20
    for k in range(4):
        motion = RigidMotion(rotation=turned, translation=np.array([1e-4, 0.0, 0.0]))
        found = reference.corrected(dots, sticks, motion)
        assert found.rotation == pytest.approx(turned, abs=1e-9) and found.translation == pytest.approx(motion.translation, abs=1e-9)
        dots = dots @ turned.T + motion.translation


def test_the_pose_accumulates_the_motions():
    def step(turn):
        points = np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]])
        c, s = np.cos(turn), np.sin(turn)
        return fit_rigid(points, points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [1e-4, 0, 0])
    pose = ObjectPose()
    assert pose.process(False, step(0.1), 0.1, 0.9) is None
    for k in range(4):
        found = pose.process(True, step(0.1), 0.1, 1.0 + 0.1 * k)
    assert np.arctan2(found[0][1, 0], found[0][0, 0]) == pytest.approx(0.3) and found[1][0] > 2.9e-4
    assert pose.process(True, None, np.nan, 1.4) is None
    assert pose.process(True, step(0.1), 0.1, 1.5) is None  # the pose at its start is unknown
    assert pose.process(True, step(0.0), 0.3, 1.6) is not None
    assert pose.process(False, None, np.nan, 1.7) is None
    assert np.array_equal(pose.process(True, None, np.nan, 1.8)[0], np.eye(3))
    assert pose.process(True, None, np.nan, 1.9) is not None, 'too few dots touch at first'
    assert pose.process(True, step(0.1), 0.1, 2.0)[1][0] == pytest.approx(1e-4)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.geometry import rotation_matrix
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.touchpad.slip import ObjectMotion


def moved(dots, turn, shift, state=1, seed=9, noise=20e-6):
    """The same dots after the object, and those that touch with it, have moved."""
    touched = dots.score > 0.5
    dots.xyz[touched] = dots.xyz[touched] @ rotation_matrix(np.array(turn, float)).T + shift
    dots.xyz += np.random.default_rng(seed).normal(0, noise, dots.xyz.shape)
    dots.state = np.where(touched, state, 0).astype(np.uint8)
    dots.sigma = noise
    return dots


def test_unknown_before_and_without_contact(pad):
    motion = ObjectMotion(23, 23)
    for k in range(3):
        estimate = motion.process(pad.disc(radius=-1e-2), 0.1 * k)
        assert estimate.motion is None and np.isnan(estimate.interval) and np.isnan(estimate.slip).all()


def test_motion_of_dots_that_stick(pad):
    motion = ObjectMotion(23, 23)
    motion.process(pad.disc(radius=6e-3), 0.0)
    estimate = motion.process(moved(pad.disc(radius=6e-3), [0, 0, 0.05], [0.2e-3, 0, -0.1e-3]), 0.1)
    assert estimate.interval == pytest.approx(0.1)
    np.testing.assert_allclose(estimate.motion.rotation_vector, [0, 0, 0.05], atol=4e-3)
    middle = np.array([[0, 0, 11e-3]])
    np.testing.assert_allclose(estimate.motion.apply(middle)[0], [0.2e-3, 0, 10.9e-3], atol=15e-6)


def test_slip_of_the_others_is_measured(pad):
    motion = ObjectMotion(23, 23)
    motion.process(pad.disc(radius=6e-3), 0.0)
    dots = moved(pad.disc(radius=6e-3), [0, 0, 0], [0.2e-3, 0, 0])
    lags = (dots.score > 0.5) & (dots.xyz[:, 0] > 3e-3)
    dots.xyz[lags] -= [0.15e-3, 0, 0]
    estimate = motion.process(dots, 0.1)
    np.testing.assert_allclose(estimate.slip[lags].mean(axis=0), [-0.15e-3, 0, 0], atol=15e-6)
    assert np.isnan(estimate.slip[dots.score <= 0.5]).all()


def test_each_region_has_a_motion_of_its_own(pad):
    motion = ObjectMotion(23, 23)
    motion.process(pad.disc(radius=8e-3), 0.0)
    dots = moved(pad.disc(radius=8e-3), [0, 0, 0], [0.2e-3, 0, 0])
    right = (dots.score > 0.5) & (dots.xyz[:, 0] > 1e-3)
    left = (dots.score > 0.5) & ~right
    dots.xyz[right] += [-0.2e-3, 0.3e-3, 0]
    estimate = motion.process(dots, 0.1, [left, right])
    np.testing.assert_allclose(estimate.motion.apply(np.array([[0, 0, 11e-3]]))[0], [0.2e-3, 0, 11e-3], atol=20e-6)
    assert np.sqrt(np.mean(estimate.slip[left | right]**2)) < 30e-6


def test_gross_slip_leaves_it_unknown(pad):
    motion = ObjectMotion(23, 23)
    motion.process(pad.disc(), 0.0)
    assert motion.process(moved(pad.disc(), [0, 0, 0], [0, 0, 0], state=2), 0.1).motion is None


def test_interval_is_the_least_that_is_long_enough(pad):
    motion = ObjectMotion(23, 23, interval_s=0.1)
    intervals = [motion.process(moved(pad.disc(radius=6e-3), [0, 0, 0], [0, 0, 0], seed=k), k / 30).interval for k in range(8)]
    np.testing.assert_allclose(intervals[1:], [1 / 30, 2 / 30, 0.1, 0.1, 0.1, 0.1, 0.1], rtol=1e-6)


def test_stamp_must_grow_and_interval_be_positive(pad):
    motion = ObjectMotion(23, 23)
    motion.process(pad.disc(), 1.0)
    for stamp in (1.0, 0.5, np.nan):
        with pytest.raises(BadFrame):
            motion.process(pad.disc(), stamp)
    with pytest.raises(BadArgument):
        ObjectMotion(23, 23, interval_s=0)


@pytest.mark.parametrize('name', ['tp_rect_drag', 'tp_disc_twist', 'tp_ring_press'])
def test_recordings(recording, name, pad):
    truth, motion, rng, errors = recording(name), ObjectMotion(23, 23, interval_s=0.03), np.random.default_rng(0), []
    for k, stamp in enumerate(truth['timestamps']):
        dots = pad.disc()
        dots.xyz = truth['dot_xyz'][k] + rng.normal(0, 20e-6, (529, 3))
        dots.state, dots.sigma = truth['dot_state'][k], 20e-6
        found = motion.process(dots, stamp).motion
        if found is not None and np.mean(dots.state[dots.state > 0] == 1) > 0.5:
            tip = truth['obj_p'][k - 1].astype(float)
            shift = found.apply(tip[None])[0] - tip - truth['obj_disp'][k]
            errors.append([np.linalg.norm(shift), np.linalg.norm(found.rotation_vector - truth['obj_rotvec'][k])])
    shift, turn = np.median(errors, axis=0)
    assert len(errors) > 8 and shift < 20e-6 and np.degrees(turn) < 0.3

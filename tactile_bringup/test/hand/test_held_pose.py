# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pose of a held object from sensors with known noise."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_bringup.hand.constants import HAND
from tactile_bringup.hand.held_pose import HeldPoseTracker, Report

STEP = 0.02
LEFT = Rotation.from_matrix(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])), np.array([-0.02, 0.0, 0.0])  # z to the object
RIGHT = Rotation.from_matrix(np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])), np.array([0.02, 0.0, 0.0])
SPEED, SPIN = np.array([0.0, 0.3e-3, -1.0e-3]), np.array([0.05, 0.0, 0.0])  # of the object, m/s and rad/s


def object_at(time_s):
    """Rotation and translation since 0 s of the object, which rests at first, and rotates about the middle between the fingers."""
    time_s = max(time_s - 2 * HAND.gripped_s, 0.0)
    return Rotation.from_rotvec(SPIN * time_s), SPEED * time_s


class Fingers:
    """An array on the left and a touchpad on the right, whose noise is that which the tracker assumes."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def array(self, time_s, sigma=3e-5):
        turn, moved = object_at(time_s)
        position = LEFT[0].inv().apply(turn.apply(LEFT[1]) + moved - LEFT[1]) + self.rng.normal(0, [sigma, sigma, 0])
        position[2] = np.nan
        return Report(time_s, LEFT, True, position, np.diag([sigma**2, sigma**2, np.nan]),
                      float(object_at(time_s)[0].as_rotvec()[0] + self.rng.normal(0, np.radians(0.5))))

    def touchpad(self, time_s, known=True):
        (turn, moved), (turn_before, moved_before) = object_at(time_s), object_at(time_s - STEP)
        step = turn * turn_before.inv()
        shift = moved - step.apply(moved_before)
        noise = Rotation.from_rotvec(np.radians([0.05, 0.05, 0.005]) * self.rng.normal(size=3))
        real = RIGHT[0].inv().apply(step.apply(RIGHT[1]) + shift - RIGHT[1])
        motion = noise * RIGHT[0].inv() * step * RIGHT[0], self.rng.normal(0, [1.5e-6, 1.5e-6, 8e-6]) + noise.apply(real)
        return Report(time_s, RIGHT, True, np.zeros(3), has_motion=True, motion=motion if known else None,
                      interval=STEP if known else np.nan)


def followed(seed, seconds=1.2, array=True, touchpad=True, unknown=()):
    """(error (6,), covariance) at the end, of the displacement since the grip; unknown: frames without a motion."""
    tracker, fingers, first = HeldPoseTracker(array + touchpad), Fingers(seed), None
    for k in range(round(seconds / STEP)):
        time_s = k * STEP
        if array:
            tracker.take('array', fingers.array(time_s))
        if touchpad:
            tracker.take('touchpad', fingers.touchpad(time_s, k not in unknown))
        found = tracker.pose()
        first = first or (found and (time_s, found.position))
    turn, moved = (object_at(time_s)[k] for time_s, k in ((time_s, 0), (time_s, 1)))
    start_turn, start_moved = object_at(first[0])
    real = turn * start_turn.inv()
    origin = real.apply(first[1] - start_moved) + moved
    return np.concatenate([found.position - origin, (found.rotation * real.inv()).as_rotvec()]), found.covariance


@pytest.mark.parametrize(('array', 'touchpad'), [(True, True), (False, True)])
def test_errors_are_as_large_as_their_covariance_says(array, touchpad):
    squares = [error @ np.linalg.solve(covariance, error) for error, covariance in
               (followed(seed, array=array, touchpad=touchpad) for seed in range(20))]
    assert 0.7 < np.mean(squares) / 6 < 1.4, 'three standard deviations of the mean'


def test_two_sensors_know_more_than_either():
    both, alone, other = (np.sqrt(np.diag(followed(0, **used)[1])) for used in ({}, {'array': False}, {'touchpad': False}))
    assert (both[4:] < 0.2 * np.minimum(alone, other)[4:]).all(), 'tilt, by positions on both sides'


def test_an_array_alone_knows_position_along_it_and_turn():
    error, covariance = followed(1, touchpad=False)
    assert np.abs(error[1:3]).max() < 3e-4 and abs(error[3]) < 0.05
    assert np.sqrt(np.diag(covariance)[0]) > 1e-3, 'nothing is known along the normal'


def test_motion_that_the_touchpad_does_not_know_is_known_by_the_array():
    lost = range(30, 40)
    assert np.sqrt(np.diag(followed(2, array=False, unknown=lost)[1])[1]) > 3e-3
    error, covariance = followed(2, unknown=lost)
    at_array = np.concatenate([[0, 1, 0], np.cross(LEFT[1], [0, 1, 0])])  # what moves its contact along y
    assert np.sqrt(at_array @ covariance @ at_array) < 6e-5 and abs(at_array @ error) < 2e-4


def report(time_s, touches=True):
    return Report(time_s, LEFT, touches, np.zeros(3), 1e-9 * np.eye(3))


def test_an_object_is_held_from_a_lasting_contact_of_two_sensors_until_none_touches():
    tracker = HeldPoseTracker()
    for k in range(20):
        tracker.take('one', report(0.1 * k))
        assert not tracker.is_held and tracker.pose() is None, 'one finger holds nothing'
    tracker.take('two', report(2.0))
    tracker.take('two', report(2.0 + 0.9 * HAND.gripped_s))
    assert not tracker.is_held
    tracker.take('two', report(2.0 + 1.1 * HAND.gripped_s))
    assert tracker.is_held
    tracker.take('two', report(2.3, touches=False))
    assert tracker.is_held and tracker.pose() is not None
    tracker.take('one', report(2.4, touches=False))
    assert not tracker.is_held


def test_a_sensor_of_unknown_pose_says_nothing():
    tracker = HeldPoseTracker(1)
    for k in range(30):
        tracker.take('one', Report(0.1 * k, None, True))
    assert tracker.pose() is None


def test_a_recording_that_is_played_again_begins_anew():
    tracker = HeldPoseTracker(1)
    for k in range(30):
        tracker.take('one', report(0.1 * k))
    assert tracker.is_held
    tracker.take('one', report(0.0))
    assert not tracker.is_held

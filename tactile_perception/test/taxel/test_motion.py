# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.motion import MotionTracker, SeenPressure
from tactile_perception.taxel.region import LEVEL, ContactScore
from taxel_pictures import ARRAY, bar, picture

PAD = SoftPad()
SCORE = ContactScore(ARRAY, PAD)


def played(places, load=lambda k: 3e4, rate=100.0):
    """Motions of each frame of a bar at places (x mm, y mm, turn), seen without the lead that traction makes."""
    tracker, found = MotionTracker(ARRAY, PAD), []
    for k, (x, y, turn) in enumerate(places):
        image = picture(bar(x, y, turn), load(k))
        found.append(tracker.process(image, SCORE.compute(image, 20.0) > LEVEL, 1 + k / rate, SeenPressure(image, 20.0)))
    return found


def test_velocity_of_a_fast_translation():
    motion = played([(0.05 * k, 0.02 * k, 0.0) for k in range(60)])[-1]
    assert motion.linear == pytest.approx([5e-3, 2e-3], abs=3e-4) and motion.turn == pytest.approx(0, abs=0.05)


def test_grip_force_alone_is_no_slip():
    for motion in played([(0, 0, 0.3)] * 60, lambda k: 2e4 + 1e4 * np.sin(k / 5)):
        assert not motion.slipping.any()


def test_traction_that_a_falling_load_lets_go_is_no_slip():
    """The picture goes back with traction over pressure, half of the thickness times that of the load that is gone."""
    held, back = [(0.025 * min(k, 20), 0.0, 0.3) for k in range(40)], 0.008
    places = held + [(held[-1][0] - back * (k + 1), 0.0, 0.3) for k in range(6)]
    motions = played(places, lambda k: 3e4 * (1 - 0.03 * max(k - 39, 0)))
    assert any(motion.slipping.any() for motion in motions[:21])
    assert not any(motion.slipping.any() for motion in motions[30:])


def test_motion_of_a_picture_without_features_is_not_known():
    tracker = MotionTracker(ARRAY, PAD)
    full = np.ones((44, 44), np.float32)
    motion = tracker.process(full * 3e4, full > 0, 1.0, SeenPressure(full * 3e4, 20.0))
    assert np.isnan(motion.linear).all() and not motion.slipping.any()


def test_few_coarse_taxels_show_a_jump_of_the_object_and_not_a_change_of_load():
    coarse = TaxelArray(13, 6, 3.4e-3)
    values = np.zeros((13, 6), np.float32)
    values[3:6, 2:4] = 3e4

    def slips(pictures):
        tracker = MotionTracker(coarse, PAD)
        found = [tracker.process(p, p > 0, 0.03 * k, SeenPressure(p, 20.0)) for k, p in enumerate(pictures)]
        return [bool(motion.slipping.any()) for motion in found], found
    assert not any(slips([values * load for load in (1, 1, 1.2, 1.5, 2, 1, 0.7, 0.7, 0.7)])[0])
    seen, found = slips([values] * 6 + [np.roll(values, 2, axis=0)] * 3)
    assert seen[6] and not any(seen[:6]) and found[6].linear[1] > 0.01


@pytest.mark.parametrize('seed', range(3))
def test_a_load_that_flickers_and_leans_with_itself_is_no_slip(seed):
    rng, coarse = np.random.default_rng(seed), TaxelArray(13, 6, 3.4e-3)
    profile, lean = np.array([36, 55, 216, 138, 35], np.float32), np.array([0.45, 0.4, 0.05, 0.05, -0.1], np.float32)
    tracker = MotionTracker(coarse, PAD)
    for k in range(200):
        image = np.zeros((13, 6), np.float32)
        image[6:11, 4] = 100 * profile * (1 + 0.25 * lean * rng.normal() + 0.1 * rng.normal())
        motion = tracker.process(image, image > 4500, k / 31, SeenPressure(image, 20.0))
        assert not motion.slipping.any(), k


def test_a_load_that_grows_evenly_does_not_move_the_picture():
    quiet = played([(0.0, 0.0, 0.3)] * 60, lambda k: 3e4 * (1 + 0.004 * k))
    assert max(np.abs(motion.step).max() for motion in quiet[5:]) < 1e-6

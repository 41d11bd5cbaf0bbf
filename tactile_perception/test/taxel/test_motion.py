# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from types import SimpleNamespace

import numpy as np
import pytest
from taxel_pictures import ARRAY, bar, picture

from tactile_perception._core.taxel import LEVEL, MotionTracker, SurfaceShear
from tactile_perception.common.estimates import GROSS, INCIPIENT, NONE
from tactile_perception.taxel.estimator import TaxelEstimator
from tactile_perception.taxel.motion import TaxelSlip
from tactile_perception.taxel.pressure import SoftPad, TaxelArray, pad_on
from tactile_perception.taxel.region import ContactScore

PAD = SoftPad()
COARSE = TaxelArray(13, 6, 3.4e-3)
SCORE = ContactScore(ARRAY, PAD)


def tracker_on(array=ARRAY, pad=PAD):
    return MotionTracker(pad_on(array, pad))


def played(positions, load=lambda k: 3e4, rate=100.0, pad=PAD):
    """Motions of each frame of a bar at positions (x mm, y mm, turn), observed without the lead that traction causes."""
    tracker, found = tracker_on(pad=pad), []
    for k, (x, y, turn) in enumerate(positions):
        image = picture(bar(x, y, turn), load(k))
        found.append(tracker.process(image, SCORE.compute(image, 20.0) > LEVEL, image, 20.0, 1 + k / rate))
    return found


def test_velocity_of_a_fast_translation():
    motion = played([(0.05 * k, 0.02 * k, 0.0) for k in range(60)])[-1]
    assert motion.linear == pytest.approx([5e-3, 2e-3], abs=3e-4) and motion.turn == pytest.approx(0, abs=0.05)


def test_a_change_of_grip_force_alone_is_no_slip():
    for motion in played([(0, 0, 0.3)] * 60, lambda k: 2e4 + 1e4 * np.sin(k / 5)):
        assert not motion.slipping.any()


def test_traction_released_by_a_falling_load_is_no_slip():
    """The image moves back with traction over pressure, by half of the thickness times that of the removed load."""
    held, back = [(0.025 * min(k, 20), 0.0, 0.3) for k in range(40)], 0.008
    positions = held + [(held[-1][0] - back * (k + 1), 0.0, 0.3) for k in range(6)]
    motions = played(positions, lambda k: 3e4 * (1 - 0.03 * max(k - 39, 0)))
    assert any(motion.slipping.any() for motion in motions[:21])
    assert not any(motion.slipping.any() for motion in motions[30:])


def test_the_motion_of_an_image_without_features_is_unknown():
    tracker = tracker_on()
    full = np.ones((44, 44), np.float32)
    motion = tracker.process(full * 3e4, full > 0, full * 3e4, 20.0, 1.0)
    assert np.isnan(motion.linear).all() and not motion.slipping.any()


def test_few_coarse_taxels_show_a_jump_of_the_object_and_not_a_change_of_load():
    values = np.zeros((13, 6), np.float32)
    values[3:6, 2:4] = 3e4

    def slips(pictures):
        tracker = tracker_on(COARSE)
        found = [tracker.process(p, p > 0, p, 20.0, 0.03 * k) for k, p in enumerate(pictures)]
        return [bool(motion.slipping.any()) for motion in found], found
    assert not any(slips([values * load for load in (1, 1, 1.2, 1.5, 2, 1, 0.7, 0.7, 0.7)])[0])
    seen, found = slips([values] * 6 + [np.roll(values, 2, axis=0)] * 3)
    assert seen[6] and not any(seen[:6]) and found[6].linear[1] > 0.01


@pytest.mark.parametrize('seed', range(3))
def test_a_flickering_load_with_proportional_traction_is_no_slip(seed):
    rng = np.random.default_rng(seed)
    profile, lean = np.array([36, 55, 216, 138, 35], np.float32), np.array([0.45, 0.4, 0.05, 0.05, -0.1], np.float32)
    tracker = tracker_on(COARSE)
    for k in range(200):
        image = np.zeros((13, 6), np.float32)
        image[6:11, 4] = 100 * profile * (1 + 0.25 * lean * rng.normal() + 0.1 * rng.normal())
        motion = tracker.process(image, image > 4500, image, 20.0, k / 31)
        assert not motion.slipping.any(), k


def test_a_uniformly_growing_load_causes_no_motion():
    quiet = played([(0.0, 0.0, 0.3)] * 60, lambda k: 3e4 * (1 + 0.004 * k))
    assert max(np.abs(motion.step).max() for motion in quiet[5:]) < 1e-6


RUBBER = SoftPad(thickness=0.002, shear_modulus=1e5, friction=0.5)
DRAGGED = picture(bar(), blur=0.1) > 30
PRESSURE = picture(bar(), 30e3)


def drag(shear, distance, steps=40):
    return [shear.move(DRAGGED, PRESSURE, np.array([distance / steps, 0.0, 0.0])) for _ in range(steps)]


def test_a_small_drag_sticks_with_at_least_the_traction_of_the_pads_stiffness():
    shear = SurfaceShear(pad_on(ARRAY, RUBBER))
    assert np.abs(sum(drag(shear, 2e-5))).max() < 1e-9
    assert 1.0 < shear.force[0] / (5e7 * 2e-5 * 160e-6) < 2.0 and abs(shear.force[1]) < 1e-6


def test_the_rim_slips_first_and_then_all_taxels():
    shear = SurfaceShear(pad_on(ARRAY, RUBBER))
    slip = np.hypot(*sum(drag(shear, 2.6e-4)))[DRAGGED]
    assert 0.05 < (slip > 1e-6).mean() < 0.9
    slip = np.hypot(*drag(shear, 1e-3)[-1])
    assert (slip[DRAGGED] > 1e-6).all() and slip[~DRAGGED].max() < 1e-9
    assert shear.force[0] == pytest.approx(0.5 * PRESSURE[DRAGGED].sum() * 1e-6, rel=0.12)


def test_the_pressure_image_leads_and_its_moment_balances_the_traction():
    shear = SurfaceShear(pad_on(ARRAY, RUBBER))
    assert not shear.traction_pressure().any()
    drag(shear, 1e-3)
    lead = shear.traction_pressure()
    assert lead.sum() == pytest.approx(0, abs=1e-2 * np.abs(lead).sum())
    assert (lead * ARRAY.x).sum() * 1e-6 == pytest.approx(RUBBER.thickness * shear.force[0], rel=0.05)


FLUID = SoftPad(shear_modulus=1.0)  # without traction, and so without a lead of the picture


@pytest.mark.parametrize('shift, turn', [((0.3, 0.1), 0.0), ((-0.5, 0.4), 0.02), ((0.0, 0.0), -0.05), ((0.0, 0.0), 0.0)])
def test_translation_and_rotation_of_a_bar(shift, turn):
    seen = played([(0.0, 0.0, 0.3), (*shift, 0.3 + turn)], pad=FLUID)[-1]
    assert 1e3 * seen.step == pytest.approx(shift, abs=0.04) and seen.step_turn == pytest.approx(turn, abs=0.004)


def test_a_stop_is_detected_within_two_frames_and_one_frame_has_no_velocity():
    found = played([(0.04 * min(k, 17), 0.0, 0.3) for k in range(20)])
    assert np.isnan(found[0].linear).all() and not found[0].slipping.any()
    assert found[17].slipping.any() and not found[19].slipping.any()


def stepped(*images):
    """Motion, mm, of the last image of a few coarse taxels, and which taxels are in contact."""
    tracker = tracker_on(COARSE, FLUID)
    return [1e3 * tracker.process(image, touched, image, 0.1, 1 + k / 100).step for k, (image, touched) in enumerate(images)][-1]


def test_a_contact_of_few_taxels_moves_as_its_pressure_does():
    values = np.zeros((13, 6), np.float32)
    values[4:6, 2:4] = 3e4
    later, far = np.roll(values, 2, axis=0), np.roll(values, 7, axis=0)
    assert stepped((values, values > 0), (later, later > 0)) == pytest.approx([0, 6.8], abs=1e-3)
    assert np.isnan(stepped((values, values > 0), (far, far > 0))).all()


def test_a_taxel_that_enters_the_contact_does_not_move_the_centroid():
    values = np.zeros((13, 6), np.float32)
    values[4:8, 2] = 1e4, 2e4, 1e4, 4.9e3
    assert stepped((values, values > 5e3), (values * np.float32(1.04), values > 4.8e3)) == pytest.approx([0, 0], abs=1e-5)


def sliding(fraction):
    return SimpleNamespace(slipping_fraction=fraction, unseen=0.0, **dict.fromkeys(
        ('linear', 'angular', 'velocity_covariance', 'rotation_center', 'x', 'y', 'vx', 'vy')))


def test_states_follow_the_slipping_fraction():
    slip = TaxelSlip()
    assert [slip.process(sliding(fraction)).state for fraction in (0.0, 0.2, 1.0, 0.0)] == [NONE, INCIPIENT, GROSS, NONE]
    assert slip.process(None).state == NONE


def test_centre_of_rotation_and_velocities_of_a_turning_bar():
    estimator, centre, turn = TaxelEstimator(ARRAY, PAD), np.array([4.0, 3.0]), 0.5
    for k in range(48):
        angle = turn * 0.01 * max(k - 16, 0)
        x, y = centre - [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]] @ centre
        found = estimator.process(np.float32(3) + (picture(bar(x, y, 0.3 + angle)) if k > 7 else np.zeros((44, 44))), 1 + 0.01 * k).slip
    assert found.state == GROSS
    assert 1e3 * found.rotation_center[:2] == pytest.approx(centre, abs=0.5) and found.angular[2] == pytest.approx(turn, rel=0.1)
    turned, middle = found.angular[2], found.rotation_center
    assert found.vx == pytest.approx(-turned * (found.y - middle[1])) and found.vy == pytest.approx(turned * (found.x - middle[0]))

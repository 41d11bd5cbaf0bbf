# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Ambient light before, between and during contacts, on outputs made up for the test: a detector whose four outputs are bilinear, so that
the cross term of a single contact is x y times its light."""
import numpy as np
import pytest
from played import PERIOD, Player, each_sample, touches

from tactile_perception.finger.constants import FINGER
from tactile_perception.finger.map import MIX, centroid, log_map
from tactile_perception.finger.model import FingerModel
from tactile_perception.finger.parameters import FingerSettings, PsdFinger

NOISE = 0.006  # V of an output
ROOM = np.array([0.30, 0.26, 0.36, 0.40])  # V, of the untouched outputs
PER_SUM = MIX.T / 4  # sums @ PER_SUM are outputs
REST = 600  # samples before what a test looks at


def calibrated(room=ROOM, cross=True):
    """The model of a finger that was calibrated in that room."""
    known = np.array([0, 0, 0, 1.0, 0, 0]) if cross else None
    return FingerModel(cross=known, cross_volts=0.005, room=room, deviation=0.002)


def finger(room=ROOM, cross=True):
    """The player of such a finger, with a result for each sample."""
    return each_sample(calibrated(room, cross), saturation=20.0)


def spot(x, y, light=1.0):
    """Outputs (4,), V, of one spot."""
    return light * np.array([x, y, 1.0, x * y]) @ PER_SUM


def lamp(count, at, rise, light):
    """Outputs (count, 4) of a lamp that lights the room within rise samples."""
    return np.clip((np.arange(count) - at) / rise, 0, 1)[:, None] * (light * ROOM / ROOM.sum())


def approach(outputs):
    """Light of an object that touches within 15 samples and then sends outputs (N, 4)."""
    return np.concatenate([np.linspace(0, 1, 15)[:, None] ** 2 * outputs[0], outputs])


def noisy(outputs, seed=0):
    """Outputs (N, 4) with noise."""
    return outputs + np.random.default_rng(seed).normal(0, NOISE, outputs.shape)


def detected(made, volts, size=5):
    """Return contact (N,) and positions (N, 2), in half widths, NaN without contact, of voltages in batches."""
    found = touches(made.play(volts, size), len(volts))
    normals = np.array([np.full(3, np.nan) if touch is None else touch.normal for touch in found])
    return np.array([touch is not None for touch in found]), log_map(normals) / FINGER.nominal_beta


def pressed(outputs, size=5, made=None, room=ROOM):
    """Return positions (N, 2) of a contact with outputs (N, 4), and the change of the offset (4,), after a start in the room's light."""
    made = made or finger()
    detected(made, noisy(np.tile(room, (REST, 1)), 1), size)
    before = made.finger.offset
    contact, positions = detected(made, noisy(room + approach(outputs)), size)
    assert contact[20:60].all()
    return positions[15:], made.finger.offset - before


def max_error(positions, position):
    """Return the maximum distance, in half widths, of means of 20 positions from a position."""
    mean = positions[:len(positions) // 20 * 20].reshape(-1, 20, 2).mean(1)
    return np.linalg.norm(mean - position, axis=1).max()


def test_offset_and_noise_are_measured_in_several_calls_and_a_contact_does_less_harm():
    made, volts = finger(), noisy(np.tile(ROOM, (500, 1)))
    for k in range(0, 195, 5):
        assert not made.play(volts[k:k + 5]) and not made.finger.ready
    assert [k for k, _ in made.play(volts[195:210])] == list(range(5, 15)) and made.finger.ready
    assert made.finger.offset == pytest.approx(ROOM, abs=2e-3) and made.finger.sigma == pytest.approx(2 * NOISE, rel=0.2)
    touched = finger()
    touched.play(volts[:200] + np.repeat([0, 0.5], [150, 50])[:, None])
    assert touched.finger.offset == pytest.approx(ROOM, abs=4e-3)


def test_drift_and_noise_are_tracked_and_a_calm_room_is_averaged_over_seconds():
    made, drift = finger(), 0.05 * PERIOD * np.arange(8000)
    contact, _ = detected(made, noisy(ROOM + drift[:, None] / 4))
    assert not contact.any() and made.finger.offset.sum() == pytest.approx(ROOM.sum() + drift[-1], abs=0.01)
    calm = [finger() for _ in range(10)]
    for seed, one in enumerate(calm):
        detected(one, noisy(np.tile(ROOM, (5000, 1)), seed), 50)
    errors = np.array([one.finger.offset.sum() - ROOM.sum() for one in calm])
    assert np.sqrt(np.mean(errors**2)) < 1.5e-3
    detected(made, ROOM + drift[-1] / 4 + np.random.default_rng(1).normal(0, 1.5 * NOISE, (8000, 4)))
    assert made.finger.sigma == pytest.approx(3 * NOISE, rel=0.15)


def test_drift_is_extrapolated_during_a_contact():
    made, drift = finger(), 0.08 * PERIOD * np.arange(5000)
    touch = np.zeros(5000)
    touch[4000:4015], touch[4015:4400] = np.linspace(0, 1, 15) ** 2, 1.0
    detected(made, noisy(ROOM + drift[:, None] / 4 + touch[:, None] * spot(0.2, -0.3, 2.0))[:4390])
    assert made.finger.offset.sum() == pytest.approx(ROOM.sum() + drift[4390], abs=0.02)


@pytest.mark.parametrize('size', [1, 5, 64, 2000])
@pytest.mark.parametrize('light', [0.2, 1.0, 4.0])
def test_a_lamp_is_no_contact_and_its_light_the_offsets(size, light):
    made, steps = finger(), np.repeat([0, 1, 2], [1000, 500, 500])
    volts = noisy(ROOM + light * steps[:, None] * ROOM / ROOM.sum())
    contact, _ = detected(made, volts[:1030], size)
    assert not contact.any() and made.finger.offset.sum() == pytest.approx(ROOM.sum() + light, abs=0.04), 'within 30 ms'
    assert not detected(made, volts[1030:], size)[0].any()


def test_a_single_spike_is_no_contact():
    volts = noisy(np.tile(ROOM, (1000, 1)))
    volts[500] += 0.8
    assert not detected(finger(), volts)[0].any()


@pytest.mark.parametrize('size', [1, 5, 25])
@pytest.mark.parametrize('light', [0.6, -0.6])
@pytest.mark.parametrize('rise', [1, 20, 100])
def test_a_lamp_does_not_shift_a_resting_object_and_its_light_joins_the_offset(size, light, rise):
    positions, shift = pressed(spot(-0.35, 0.2, 2.5) + lamp(1000, 300, rise, light), size)
    assert shift.sum() == pytest.approx(light, abs=0.04)
    assert max_error(positions[20:], (-0.35, 0.2)) < 0.02


def test_an_object_that_is_pressed_harder_is_not_taken_for_a_lamp():
    light = 1.5 + np.clip((np.arange(1000) - 300) / 30, 0, 1)
    _, shift = pressed(light[:, None] * spot(-0.35, 0.2))
    assert np.abs(shift).max() < 5e-3


def test_room_light_that_stays_after_the_object_ends_the_contact():
    made = finger()
    _, shift = pressed(np.concatenate([np.tile(spot(-0.35, 0.3, 2.0), (300, 1)), np.tile(0.5 * ROOM, (200, 1))]), made=made)
    assert shift == pytest.approx(0.5 * ROOM, abs=0.02)
    assert not detected(made, noisy(np.tile(1.5 * ROOM, (50, 1))))[0].any()


@pytest.mark.parametrize('creep', [0.0, 0.03])
def test_a_lamp_at_the_position_of_the_contact_is_recognised_when_the_object_leaves(creep):
    beside = centroid((ROOM @ MIX)[None])[0]
    grows = 1 - creep * np.exp(-np.maximum(np.arange(1000) - 250, 0) / 80)
    positions, shift = pressed(spot(*beside, 2.5) * (grows * (np.arange(1000) < 700))[:, None] + lamp(1000, 300, 10, 0.6))
    assert shift == pytest.approx(0.6 * ROOM / ROOM.sum(), abs=0.02) and np.isnan(positions[-100:]).all()


def test_a_contact_that_grows_weak_at_its_position_persists():
    light = np.interp(np.arange(1000), [300, 310, 700, 710], [2.0, 2.6, 2.6, 1.0])
    _, shift = pressed(light[:, None] * spot(0.05, 0.05))
    assert np.abs(shift).max() < 5e-3


@pytest.mark.parametrize('part', [0.0, 0.06])
def test_the_shaded_part_of_the_rooms_light_is_measured(part):
    made = finger(room=np.zeros(4))
    for x, y in ((0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4)) * 3:
        positions, _ = pressed(np.tile(spot(x, y, 0.8) - part * ROOM, (300, 1)), made=made)
    assert max_error(positions[-100:], (-0.4, -0.4)) < 0.02


def test_a_twentieth_of_what_the_room_has_beyond_that_of_the_calibration_is_expected_to_be_shaded():
    positions, _ = pressed(np.tile(spot(0.3, 0.3, 0.8), (100, 1)), made=finger(0.4 * ROOM, cross=False))
    expected = centroid((spot(0.3, 0.3, 0.8) + 0.05 * 0.6 * ROOM)[None] @ MIX)[0]
    assert positions[-50:].mean(0) == pytest.approx(expected, abs=0.006) and 0.3 - expected[0] > 0.012


def test_light_that_may_be_a_lamps_widens_the_covariance():
    """A lamp at the position of the contact, until the object goes."""
    made, beside = Player(PsdFinger(calibrated(), FingerSettings(saturation=20.0))), centroid((ROOM @ MIX)[None])[0]
    position = beside + [0.03, 0.0]
    made.play(noisy(np.tile(ROOM, (REST, 1)), 1), 5)
    found = made.play(noisy(ROOM + approach(spot(*position, 2.0) + lamp(600, 300, 10, 0.6))), 5)
    spreads = [np.trace(touch.position_covariance) for _, touch in found if touch][1:]
    assert np.median(spreads[-30:]) > 2 * np.median(spreads[20:50])

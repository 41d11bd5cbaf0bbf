# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The core on the simulated finger: accuracy, onsets, ambient light, hard cases."""
import numpy as np
import played
import pytest
from tactile_driver.samples import SampleBlock
from tactile_driver.simulation.psd.scene import Act, Ambient, PsdScene, PsdScript
from tactile_driver.serial.psd import Demodulator

from tactile_perception._core.finger import AMBIGUOUS, OUT_OF_RANGE, SATURATED
from tactile_perception.finger.map import error_angle
from tactile_perception.finger.model import FingerModel
from tactile_perception.finger.parameters import FingerSettings, PsdFinger

PERIOD = played.PERIOD


def touched(finger, samples, truth):
    """(touches, their true normals) of all runs in contact."""
    found, true = [], []
    for run in played.runs(samples):
        chosen = samples.contact[run] & (truth.touching[run] > 0)
        if chosen.sum() > 20:
            found.append(played.touch(finger, samples, run))
            true.append(truth.normal[run][chosen].mean(0))
    return found, np.array(true)


@pytest.fixture(scope='module')
def grid(model):
    finger = PsdFinger(model)
    volts, truth = played.scene('grid')
    samples = finger.detect(volts, PERIOD)
    return finger, samples, truth


@pytest.mark.full
def test_positions_are_accurate_to_the_rim(grid):
    found, true = touched(*grid)
    error = np.degrees(error_angle(np.array([t.normal for t in found]), true))
    assert len(found) == 25 and error.mean() < 0.4 and error.max() < 1.2
    assert np.linalg.norm([t.position for t in found], axis=1) == pytest.approx(0.016)
    assert not any(t.flags for t in found)


def test_covariances_match_the_errors(grid):
    finger, samples, truth = grid
    squares = []
    for run in played.runs(samples):
        if samples.contact[run].sum() < 200:
            continue
        for k in range(run.start + 60, run.stop - 60, 15):
            touch = played.touch(finger, samples, slice(k, k + 1))
            error = touch.position - 0.016 * truth.normal[k]
            squares.append(error @ np.linalg.pinv(touch.position_covariance, rcond=1e-5) @ error / 2)
    assert len(squares) > 200 and 0.6 < np.mean(squares) < 1.4


def test_force_and_depth_follow_from_light(grid):
    finger, samples, truth = grid
    runs = [run for run in played.runs(samples) if samples.contact[run].sum() > 200]
    held = [slice(run.start + 100, run.start + 150) for run in runs]
    force = np.array([played.touch(finger, samples, r).force / truth.force[r].mean() for r in held])
    depth = np.array([played.touch(finger, samples, r).depth / truth.depth[r].mean() for r in held])
    assert np.median(np.abs(force - 1)) < 0.1 and np.median(np.abs(depth - 1)) < 0.06


@pytest.mark.parametrize('size', [1, 5, 1000])
def test_onset_and_release_come_within_a_sample_or_two(model, size):
    finger = PsdFinger(model)
    volts, truth = played.scene('taps')
    contact = np.concatenate([finger.detect(volts[k:k + size], PERIOD).contact for k in range(0, len(volts), size)])
    (on, off), (true_on, true_off) = played.onsets(contact), played.onsets(truth.touching > 0)
    late = np.r_[played.lags(true_on, on), played.lags(true_off, off)]
    assert np.mean(np.abs(late) <= 1) > 0.85 and np.abs(late).max() <= 3


@pytest.mark.parametrize('size', [1, 5, 1000, 10**6])
def test_drift_flicker_and_ambient_steps_are_no_contacts(model, size):
    finger = PsdFinger(model)
    volts, _ = played.scene('light')
    volts = volts[:15_900] if size == 1 else volts
    assert not any(finger.detect(volts[k:k + size], PERIOD).contact.any() for k in range(0, len(volts), size))


def test_the_offset_is_constant_during_a_contact(model):
    finger = PsdFinger(model)
    place = (1.0, 0.4)
    volts, truth = played.script(PsdScript([Act(0.5, 30.5, place, place, 3e-4)], 31.5))
    samples = finger.detect(volts, PERIOD)
    assert samples.contact[truth.touching > 0].mean() > 0.999 and not samples.contact[-900:].any()
    first, last = played.touch(finger, samples, slice(700, 1200)), played.touch(finger, samples, slice(29_700, 30_200))
    assert np.degrees(error_angle(first.normal, last.normal)) < 0.15


def test_two_objects_across_both_axes_are_ambiguous_and_one_is_not(model):
    finger = PsdFinger(model)
    volts, _ = played.scene('two')
    samples = finger.detect(volts, PERIOD)
    assert not played.touch(finger, samples, slice(700, 1100)).flags & AMBIGUOUS
    assert played.touch(finger, samples, slice(1400, 1800)).flags & AMBIGUOUS


def ready(model, **settings):
    """A finger with its reference taken, and what it is then over."""
    finger = PsdFinger(model, FingerSettings(**settings))
    rest = played.scene('rest')[0][:400]
    finger.detect(rest, PERIOD)
    return finger, finger.offset


def pressed(finger, net, count=50):
    """Samples of net voltages that rise within 20 ms and stay."""
    ramp = np.r_[np.linspace(0, 1, 20), np.ones(count)][:, None]
    rng = np.random.default_rng(0)
    return finger.detect(finger.offset + ramp * np.asarray(net, float) + rng.normal(0, 0.005, (len(ramp), 4)), PERIOD)


def test_light_near_zero_and_all_four_equal(model):
    finger, offset = ready(model)
    samples = finger.detect(np.tile(offset, (50, 1)), PERIOD)
    assert not samples.contact.any() and np.isnan(played.place(samples)).all() and np.isnan(finger.normals(samples)).all()
    samples = pressed(finger, [0.5, 0.5, 0.5, 0.5])
    assert samples.contact[-40:].all()
    assert played.place(samples)[-40:].mean(0) == pytest.approx([0, 0], abs=0.01)


@pytest.mark.parametrize('phi', [np.pi - 1e-6, -np.pi + 1e-6, 0.0])
def test_the_pole_and_azimuth_pi_are_nothing_special(model, phi):
    for theta in (0.0, 1e-7, 0.6):
        finger = PsdFinger(model)
        volts, truth = played.script(PsdScript([Act(0.5, 1.0, (phi, theta), (phi, theta), 3e-4)], 1.2))
        found, true = touched(finger, finger.detect(volts, PERIOD), truth)
        assert np.degrees(error_angle(found[0].normal, true[0])) < 0.6
        assert np.isfinite(found[0].position_covariance).all()


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_samples_that_are_no_numbers_are_passed_over(model, bad):
    finger, plain = PsdFinger(model), PsdFinger(model)
    volts, _ = played.scene('grid')
    volts = volts[:1000]
    spoiled = np.repeat(volts, 2, axis=0)
    spoiled[1::2, 2] = bad
    samples = finger.detect(spoiled, PERIOD)
    assert not samples.known[1::2].any() and np.isnan(played.place(samples)[1::2]).all()
    assert np.array_equal(samples.contact[::2], plain.detect(volts, PERIOD).contact)
    assert not finger.detect(np.full((7, 4), bad), PERIOD).known.any()


def test_a_dead_output_is_estimated_and_no_place_is_made_up(model):
    finger = PsdFinger(model)
    volts, _ = played.scene('grid')
    volts[:, 1] = 0.0
    samples = finger.detect(volts[:800], PERIOD)
    assert finger.stuck == [False, True, False, False]
    run = next(r for r in played.runs(samples) if samples.contact[r].any())
    touch = played.touch(finger, samples, run)
    assert np.isnan(touch.position).all() and np.isnan(touch.position_covariance).all() and touch.flags & AMBIGUOUS


def test_saturated_outputs_are_flagged_and_no_place_is_made_up(model):
    finger, _ = ready(model, saturation=1.0)
    samples = pressed(finger, [0.6, 1.2, 0.6, 0.5])
    touch = played.touch(finger, samples, slice(30, 60))
    assert touch.flags == SATURATED and np.isnan([*touch.position, *touch.normal, touch.force, touch.depth]).all()
    assert not samples.saturated[:5].any() and not any(finger.stuck)
    rising = played.touch(finger, samples, slice(8, 30))  # of which some are not saturated
    assert rising.flags & SATURATED and np.isfinite(rising.position).all()


@pytest.mark.parametrize('missing', [0.004, 0.02, 0.3])
def test_nothing_survives_a_gap_but_a_contact_that_a_short_one_interrupts(model, missing):
    place = (2.0, 0.5)
    volts, truth = played.script(PsdScript([Act(0.5, 1.5, place, place, 3e-4)], 2.5), seed=3)
    for begin in (500, 508, 800, 1490, 1499):
        finger, end = PsdFinger(model), begin + round(missing / PERIOD)
        before = finger.detect(volts[:begin], PERIOD)
        finger.interrupt(missing)
        after = finger.detect(volts[end:], PERIOD)
        true = truth.touching[end:] > 0
        assert not after.contact[np.flatnonzero(~true)[3:]].any(), begin
        assert after.contact[true].mean() > 0.97 if true.sum() > 50 else True
        assert finger.detect(volts[:400], PERIOD).contact.sum() == 0
        if begin == 800:
            assert (after.id[10] == before.id[-1]) == (missing < 0.1)


def test_negative_net_voltages_make_no_place_beyond_the_detector(model):
    finger, _ = ready(model)
    samples = pressed(finger, [-0.08, 0.9, -0.09, 0.1])
    touch = played.touch(finger, samples, slice(40, 60))
    assert touch.flags & OUT_OF_RANGE and np.isfinite(touch.position).all()
    assert not pressed(ready(model)[0], [-0.5, -0.5, -0.5, -0.5]).contact.any()


def test_without_a_calibration_it_works_as_the_nominal_sensor():
    finger = PsdFinger(FingerModel())
    volts, truth = played.scene('grid')
    samples = finger.detect(volts, PERIOD)
    assert samples.contact[truth.touching > 0].mean() > 0.98
    found, true = touched(finger, samples, truth)
    assert np.degrees(error_angle(np.array([t.normal for t in found]), true)).mean() < 20
    assert np.isnan(found[0].force) and np.isnan(found[0].depth)


def reported(finger, volts):
    """[(middle sample, touch)] of blocks of five samples."""
    found = []
    for first in range(0, len(volts), 5):
        samples = finger.detect(volts[first:first + 5], PERIOD)
        found += [(first + (run.start + run.stop - 1) // 2, played.touch(finger, samples, run))
                  for run in played.runs(samples) if samples.id[run.start]]
    return found


def squared_errors(found, truth):
    """Of results in a touch, over their covariance and the two directions along the surface: 1 in the mean where it is true."""
    squares = []
    for k, touch in found:
        if truth.touching[k]:
            off = touch.position - 0.016 * truth.normal[k]
            squares.append(off @ np.linalg.pinv(touch.position_covariance, rcond=1e-5) @ off / 2)
    return np.array(squares)


def test_in_a_bright_room_the_covariance_holds_what_is_not_known_of_the_room(model):
    volts, truth = played.scene('bright')
    squares = squared_errors(reported(PsdFinger(model), volts), truth)
    assert len(squares) > 1000 and 0.5 < squares.mean() < 2


def test_the_covariance_of_a_touch_that_is_hardly_seen_is_true(model):
    acts = [Act(0.5 + 0.5 * k, 0.8 + 0.5 * k, (0.9 * k, 1.05), (0.9 * k, 1.05), 1.25e-4) for k in range(8)]
    volts, truth = played.script(PsdScript(acts, 4.8))
    found = [(k, touch) for k, touch in reported(PsdFinger(model), volts) if np.isfinite(touch.position).all()]
    off = [np.degrees(error_angle(touch.normal, truth.normal[k])) for k, touch in found if truth.touching[k]]
    assert len(off) > 300 and np.mean(off) > 3, 'hardly seen'
    assert 0.5 < squared_errors(found, truth).mean() < 2


def test_with_modulated_light_lamps_and_flicker_are_no_contacts_and_touches_are_found(model):
    lamps = Ambient(1.2, 0.2, 3.0, 0.08, ((0.8, 0.7), (1.5, -0.9), (2.2, 2.0)))
    place, rate = (2.0, 0.9), 10_000.0
    scene = PsdScene(PsdScript([Act(1.8, 2.6, place, place, 2.4e-4)], 3.0, lamps), rate)
    lit = np.arange(scene.samples) % 2 == 0
    counts, truth = scene.play(0, scene.samples, lit)
    rows = np.column_stack([counts * played.VOLT, lit]).astype(np.float32)
    made, finger, found = Demodulator(4.9), PsdFinger(model), []
    for k in range(0, len(rows), 50):
        for block in made.net(SampleBlock(rows[k:k + 50], 10**9 + round(k / rate * 1e9), 1 / rate)):
            samples = finger.detect(block.volts, block.period_s)
            found += [(block.stamp_ns * 1e-9 - 1, samples.contact.mean(), played.touch(finger, samples, run))
                      for run in played.runs(samples) if samples.contact[run].any()]
    times = np.array([at for at, _, _ in found])
    assert 1.79 < times.min() < 1.83 and 2.57 < times.max() < 2.61
    errors = [np.degrees(error_angle(touch.normal, truth.normal[21_000])) for at, _, touch in found if 1.9 < at < 2.5]
    assert np.mean(errors) < 1.5 and finger.offset == pytest.approx(np.zeros(4), abs=5e-3)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A finger: its contacts, by the sample and by the block."""
from dataclasses import replace

import numpy as np
import played
import pytest
from played import Player, contact, each_sample, touches

from tactile_driver.frame import SampleBlock
from tactile_driver.parameters.table import defaults
from tactile_driver.serial.psd import Demodulator
from tactile_driver.simulation.psd_scene import Act, Ambient, Electronics, PsdScene, PsdScript, open_psd_scene
from tactile_perception._core.finger import AMBIGUOUS, OUT_OF_RANGE, SATURATED
from tactile_perception.common.geometry import error_angle
from tactile_perception.core.errors import BadArgument
from tactile_perception.finger.model import FingerModel
from tactile_perception.finger.parameters import PSD_METHODS, PSD_PARAMETERS, FingerSettings, PsdFinger, make_finger

PERIOD = played.PERIOD


def touched(model, volts, truth, period=PERIOD):
    """(touches, their true normals) of all contacts."""
    found = [(round(k), touch) for k, touch in Player(PsdFinger(model)).play(volts, period=period) if touch is not None]
    return [touch for _, touch in found], truth.normal[[k for k, _ in found]]


def mean_normal(found):
    """The mean of the normals of touches, a unit vector."""
    mean = np.mean([touch.normal for touch in found], axis=0)
    return mean / np.linalg.norm(mean)


@pytest.fixture(scope='module')
def grid(model):
    """(touch of each sample or None, samples in the middle of the touches, truth)"""
    volts, truth = played.scene('grid')
    found = touches(each_sample(model).play(volts), len(volts))
    begins, ends = played.onsets(truth.touching > 0)
    return found, [range(begin + 70, end - 70) for begin, end in zip(begins, ends)], truth


@pytest.mark.full
@pytest.mark.parametrize('rate, noise', [(1000.0, 1), (500.0, 1), (2000.0, 1), (1000.0, 3)])
def test_positions_are_accurate_to_the_rim_and_degrade_as_the_noise_says(model, rate, noise):
    volts, truth = played.scene('grid', rate)
    volts = volts + np.sqrt(noise**2 - 1) * Electronics().noise * np.random.default_rng(5).normal(size=volts.shape)
    found, true = touched(model, volts, truth, 1 / rate)
    error = np.degrees(error_angle(np.array([t.normal for t in found]), true))
    assert len(found) == 25 and error.mean() < 0.4 * noise and error.max() < 1.2 * noise
    assert np.linalg.norm([t.position for t in found], axis=1) == pytest.approx(0.016)
    assert not any(t.flags for t in found)


def test_covariances_match_the_errors(grid):
    found, middles, truth = grid
    squares = squared_errors([(k, found[k]) for middle in middles for k in middle[::15]], truth)
    assert len(squares) > 200 and 0.6 < squares.mean() < 1.4


def test_force_and_depth_follow_from_light(grid):
    found, middles, truth = grid
    for name, most in (('force', 0.1), ('depth', 0.06)):
        held = [(np.mean([getattr(found[k], name) for k in m[:50]]), getattr(truth, name)[m[0]:m[50]].mean()) for m in middles]
        assert np.median([abs(estimated / true - 1) for estimated, true in held]) < most


@pytest.mark.parametrize('size', [1, 5, 1000])
def test_onset_and_release_come_within_a_sample_or_two(model, size):
    volts, truth = played.scene('taps')
    found = contact(each_sample(model).play(volts, size), len(volts))
    (on, off), (true_on, true_off) = played.onsets(found), played.onsets(truth.touching > 0)
    late = np.r_[played.lags(true_on, on), played.lags(true_off, off)]
    assert np.mean(np.abs(late) <= 1) > 0.85 and np.abs(late).max() <= 3


@pytest.mark.parametrize('size', [1, 5, 1000, 10**6])
def test_drift_flicker_and_ambient_steps_are_no_contacts(model, size):
    volts, _ = played.scene('light')
    volts = volts[:15_900] if size == 1 else volts
    assert not any(touch for _, touch in Player(PsdFinger(model)).play(volts, size))


def test_the_offset_is_constant_during_a_contact(model):
    position = (1.0, 0.4)
    volts, truth = played.script(PsdScript([Act(0.5, 30.5, position, position, 3e-4)], 31.5))
    found = each_sample(model).play(volts)
    state = contact(found, len(volts))
    assert state[truth.touching > 0].mean() > 0.999 and not state[-900:].any()
    each = touches(found, len(volts))
    assert np.degrees(error_angle(mean_normal(each[700:1200]), mean_normal(each[29_700:30_200]))) < 0.15


def test_two_objects_across_both_axes_are_ambiguous_and_one_is_not(model):
    found = Player(PsdFinger(model)).play(played.scene('two')[0], 400)
    flags = {round(k) // 400: touch.flags for k, touch in found if touch is not None}
    assert not flags[2] & AMBIGUOUS and flags[4] & AMBIGUOUS


def ready(model, make=each_sample, **settings):
    """A player of a finger with its reference taken."""
    player = make(model, **settings)
    player.play(played.scene('rest')[0][:400])
    return player


def pressed(player, net, count=50):
    """Voltages over the offset of net voltages that rise within 20 ms and stay."""
    ramp = np.r_[np.linspace(0, 1, 20), np.ones(count)][:, None]
    rng = np.random.default_rng(0)
    return player.finger.offset + ramp * np.asarray(net, float) + rng.normal(0, 0.005, (len(ramp), 4))


def test_no_light_is_no_contact_and_four_equal_outputs_are_the_pole(model):
    player = ready(model)
    assert not any(touch for _, touch in player.play(np.tile(player.finger.offset, (50, 1))))
    found = touches(player.play(pressed(player, [0.5, 0.5, 0.5, 0.5])), 70)
    assert all(found[-40:]) and np.degrees(error_angle(mean_normal(found[-40:]), model.normals(np.zeros((1, 2)))[0])) < 1.5


@pytest.mark.parametrize('phi', [np.pi - 1e-6, -np.pi + 1e-6, 0.0])
def test_positions_at_the_pole_and_azimuth_pi_are_accurate(model, phi):
    for theta in (0.0, 1e-7, 0.6):
        found, true = touched(model, *played.script(PsdScript([Act(0.5, 1.0, (phi, theta), (phi, theta), 3e-4)], 1.2)))
        assert np.degrees(error_angle(found[0].normal, true[0])) < 0.6
        assert np.isfinite(found[0].position_covariance).all()


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_samples_with_nan_or_infinity_are_skipped(model, bad):
    volts = played.scene('grid')[0][:1000]
    spoiled, player = np.repeat(volts, 2, axis=0), each_sample(model)
    spoiled[1::2, 2] = bad
    found = player.play(spoiled)
    assert not any(round(k) % 2 for k, _ in found)
    assert np.array_equal(contact(found, 2000)[::2], contact(each_sample(model).play(volts), 1000))
    assert not player.play(np.full((7, 4), bad))


def test_a_dead_output_is_recognised_and_no_position_is_invented(model):
    player, volts = Player(PsdFinger(model)), played.scene('grid')[0][:800]
    volts[:, 1] = 0.0
    touch = next(touch for _, touch in player.play(volts) if touch)
    assert player.finger.stuck == [False, True, False, False]
    assert np.isnan(touch.position).all() and np.isnan(touch.position_covariance).all() and touch.flags & AMBIGUOUS


def test_saturated_outputs_are_flagged_and_no_position_is_invented(model):
    player = ready(model, saturation=1.0)
    found = touches(player.play(pressed(player, [0.6, 1.2, 0.6, 0.5])), 70)
    for touch in found[30:60]:
        assert touch.flags == SATURATED and np.isnan([*touch.position, *touch.normal, touch.force, touch.depth]).all()
    assert not any(touch and touch.flags & SATURATED for touch in found[:5]) and not any(player.finger.stuck)
    player = ready(model, lambda model, **settings: Player(PsdFinger(model, FingerSettings(**settings))), saturation=1.0)
    volts = pressed(player, [0.6, 1.2, 0.6, 0.5])
    player.play(volts[:8])
    (_, rising), = player.play(volts[8:30])  # of which some are not saturated
    assert rising.flags & SATURATED and np.isfinite(rising.position).all()


@pytest.mark.parametrize('missing', [0.004, 0.02, 0.3])
def test_nothing_survives_a_gap_but_a_contact_that_a_short_one_interrupts(model, missing):
    position = (2.0, 0.5)
    volts, truth = played.script(PsdScript([Act(0.5, 1.5, position, position, 3e-4)], 2.5), seed=3)
    for begin in (500, 508, 800, 1490, 1499):
        player, end = each_sample(model), begin + round(missing / PERIOD)
        before = player.play(volts[:begin])
        player.wait(missing)
        after = touches(player.play(volts[end:]), len(volts) - end)
        true, state = truth.touching[end:] > 0, np.array([touch is not None for touch in after])
        assert not state[np.flatnonzero(~true)[3:]].any(), begin
        assert state[true].mean() > 0.97 if true.sum() > 50 else True
        assert not any(touch for _, touch in player.play(volts[:400]))
        if begin == 800:
            assert (after[10].id == before[-1][1].id) == (missing < 0.1)


def test_negative_net_voltages_give_no_position_beyond_the_detector(model):
    player = ready(model)
    found = touches(player.play(pressed(player, [-0.08, 0.9, -0.09, 0.1])), 70)
    assert all(touch.flags & OUT_OF_RANGE and np.isfinite(touch.position).all() for touch in found[40:60])
    player = ready(model)
    assert not any(touch for _, touch in player.play(pressed(player, [-0.5, -0.5, -0.5, -0.5])))


def test_without_a_calibration_it_works_as_the_nominal_sensor():
    volts, truth = played.scene('grid')
    assert contact(each_sample(FingerModel()).play(volts), len(volts))[truth.touching > 0].mean() > 0.98
    found, true = touched(FingerModel(), volts, truth)
    assert np.degrees(error_angle(np.array([t.normal for t in found]), true)).mean() < 20
    assert np.isnan(found[0].force) and np.isnan(found[0].depth)


def reported(model, volts):
    """[(middle sample, touch)] of blocks of five samples."""
    return [(round(k), touch) for k, touch in Player(PsdFinger(model)).play(volts, 5) if touch]


def squared_errors(found, truth):
    """Of results in a touch, over their covariance and the two directions along the surface: 1 in the mean where it is true."""
    squares = []
    for k, touch in found:
        if truth.touching[k]:
            off = touch.position - 0.016 * truth.normal[k]
            squares.append(off @ np.linalg.pinv(touch.position_covariance, rcond=1e-5) @ off / 2)
    return np.array(squares)


def test_in_a_bright_room_the_covariance_contains_the_uncertainty_of_the_rooms_light(model):
    volts, truth = played.scene('bright')
    squares = squared_errors(reported(model, volts), truth)
    assert len(squares) > 1000 and 0.5 < squares.mean() < 2


def test_the_covariance_of_a_faint_contact_fits_its_errors(model):
    acts = [Act(0.5 + 0.5 * k, 0.8 + 0.5 * k, (0.9 * k, 1.05), (0.9 * k, 1.05), 1.25e-4) for k in range(8)]
    volts, truth = played.script(PsdScript(acts, 4.8))
    found = [(k, touch) for k, touch in reported(model, volts) if np.isfinite(touch.position).all()]
    off = [np.degrees(error_angle(touch.normal, truth.normal[k])) for k, touch in found if truth.touching[k]]
    assert len(off) > 300 and np.mean(off) > 3, 'hardly seen'
    assert 0.5 < squared_errors(found, truth).mean() < 2


def test_with_modulated_light_lamps_and_flicker_are_no_contacts_and_touches_are_found(model):
    lamps = Ambient(1.2, 0.2, 3.0, 0.08, ((0.8, 0.7), (1.5, -0.9), (2.2, 2.0)))
    position, rate = (2.0, 0.9), 10_000.0
    scene = PsdScene(PsdScript([Act(1.8, 2.6, position, position, 2.4e-4)], 3.0, lamps), rate)
    lit = np.arange(scene.samples) % 2 == 0
    counts, truth = scene.play(0, scene.samples, lit)
    rows = np.column_stack([counts * played.VOLT, lit]).astype(np.float32)
    made, finger, found = Demodulator(4.9), PsdFinger(model), []
    for k in range(0, len(rows), 50):
        for block in made.net(SampleBlock(rows[k:k + 50], 10**9 + round(k / rate * 1e9), 1 / rate)):
            at = block.stamp_ns * 1e-9
            found += [(at - 1, one.touch) for one in finger.estimate(block.volts, at, block.period_s).estimates if one.touch]
    times = np.array([at for at, _ in found])
    assert 1.79 < times.min() < 1.83 and 2.57 < times.max() < 2.61
    errors = [np.degrees(error_angle(touch.normal, truth.normal[21_000])) for at, touch in found if 1.9 < at < 2.5]
    assert np.mean(errors) < 1.5 and finger.offset == pytest.approx(np.zeros(4), abs=5e-3)


VALUES = defaults(PSD_PARAMETERS)


@pytest.fixture(scope='module')
def taps():
    scene = open_psd_scene('taps', 1000.0)
    counts, truth = scene.play(0, 1500)
    return counts * (5 / 4096), truth


def results(finger, *batch):
    """[(mean index of the samples, contacts)] of a batch."""
    return [(one.at, [] if one.touch is None else [one.touch]) for one in finger.estimate(*batch).estimates]


def run(finger, volts, batch):
    return [(first + k, felt) for first in range(0, len(volts), batch)
            for k, felt in results(finger, volts[first:first + batch], 1 + 1e-3 * first, 1e-3)]


def test_one_result_a_block_and_one_on_either_side_of_an_edge_each_at_the_mean_of_its_samples(taps):
    found = run(make_finger(FingerModel(), VALUES), taps[0], 50)
    middles = np.array([k for k, _ in found])
    assert (np.diff(middles) > 0).all()
    whole = [k for k in middles if k % 50 == 24.5]
    assert len(whole) == 26 - 7  # three taps, and the beginning of a fourth
    blocks = middles // 50
    for block in np.unique(blocks):
        inside = middles[blocks == block] % 50
        edges = [0.0]
        for k in inside:  # runs of consecutive samples: the middle and the start of a run give its end
            edges.append(2 * k - edges[-1] + 1)
        assert edges[-1] == 50
    assert {len(felt) for _, felt in found} == {0, 1}
    assert sorted({t.id for _, felt in found for t in felt}) == [1, 2, 3, 4]


def test_a_moving_contact_is_stamped_with_the_time_at_which_it_is_there():
    slide = Act(0.4, 0.6, (0.3, -0.9), (0.3, 0.9), 3.2e-4, 0.02)  # 520 degrees a second: 2.6 in a block
    scene = PsdScene(PsdScript([slide], 0.7), 5000.0)
    volts = scene.play(0, scene.samples)[0] * (5 / 4096)
    found = {}
    for kind in ('batch', 'sample'):
        finger, found[kind] = make_finger(FingerModel(), VALUES | {'results': kind}), []
        for first in range(0, len(volts), 25):
            found[kind] += [(first + k, np.arctan2(*felt[0].normal[[0, 2]]))
                            for k, felt in results(finger, volts[first:first + 25], first / 5000, 1 / 5000) if felt]
    blocks, singles = (np.array(rows).T for rows in found.values())
    inside = (blocks[0] > 2200) & (blocks[0] < 2800)
    smooth = np.convolve(singles[1], np.full(25, 1 / 25), 'same')
    late = blocks[1][inside] - np.interp(blocks[0][inside], singles[0], smooth)
    assert inside.sum() > 20 and abs(np.mean(late)) < np.radians(0.1) and np.abs(late).max() < np.radians(0.6)


def circling(model, values=VALUES, seed=0):
    """Of a contact that circles twice at 45 degrees, 900 degrees a second: errors (N,), degrees, of the normal; their squares over the
    covariance; and the part of the covariance that does not lie along the surface."""
    slide = Act(0.4, 1.4, (0.0, np.radians(45)), (4 * np.pi, np.radians(45)), 3.2e-4, 0.02)
    scene, finger = PsdScene(PsdScript([slide], 1.5), 5000.0, seed), make_finger(model, values)
    counts, truth = scene.play(0, scene.samples)
    found = []
    for first in range(0, len(counts), 25):
        for k, felt in results(finger, counts[first:first + 25] * (5 / 4096), first / 5000, 1 / 5000):
            if felt and 2200 < first + k < 6800:
                off = felt[0].position - 0.016 * truth.normal[int(first + k)]
                normal, spread = felt[0].normal, felt[0].position_covariance
                found.append((np.degrees(np.linalg.norm(off) / 0.016), off @ np.linalg.pinv(spread, rcond=1e-5) @ off / 2,
                              np.linalg.norm(spread @ normal) / np.trace(spread)))
    return np.array(found).T


def test_the_creep_of_the_cover_is_subtracted_from_a_sliding_contact(model):
    with_creep, without = circling(model), circling(replace(model, creep=None))
    assert without[0].mean() > 0.5 and with_creep[0].mean() < 0.3
    assert 0.2 < with_creep[1].mean() < 2, 'normalised squared error'
    assert 0.1 < without[1].mean() < 2, 'the covariance holds the creep of a typical cover'


@pytest.mark.full
def test_the_covariance_of_single_samples_in_motion_is_honest_and_lies_along_the_surface(model):
    creeps = replace(model, creep=replace(model.creep, share=0.06))  # takes some 2 degrees off
    assert 0.5 < circling(model, VALUES | {'results': 'sample'})[1].mean() < 2, 'normalised squared error'
    assert circling(creeps, VALUES | {'results': 'sample'})[2].max() < 1e-9


def lamps(seed):
    """A scene in which a lamp is switched while each of ten objects rests."""
    rng, acts, steps = np.random.default_rng(seed), [], []
    for k in range(10):
        position, size = (rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(5, 60))), rng.uniform(0.2, 0.9)
        acts.append(Act(1 + 1.3 * k, 1.9 + 1.3 * k, position, position, rng.uniform(2.3e-4, 3.4e-4), 0.02))
        steps.append((acts[-1].start + rng.uniform(0.3, 0.5), -steps[-1][1] if k % 2 else size))
    return PsdScene(PsdScript(acts, 14.0, Ambient(0.4, steps=tuple(steps), rise=0.02, shade=0.04)), 1000.0, 0)


@pytest.mark.parametrize('seed', [0, 1, 2])
def test_positions_under_a_switched_lamp_are_right_or_uncertain_and_contacts_end(model, seed):
    scene = lamps(seed)
    counts, truth = scene.play(0, scene.samples)
    ended = np.flatnonzero(np.diff((truth.touching > 0).astype(int)) < 0)
    errors, stated, late = [], [], []
    for at, felt in run(make_finger(model, VALUES), counts * (5 / 4096), 5):
        if felt and not truth.touching[int(at)]:
            late.append((at - ended).clip(0).min())
        elif felt and np.abs(at - ended).min() > 10:
            errors.append(np.linalg.norm(felt[0].position / 0.016 - truth.normal[int(at)]))
            stated.append(np.sqrt(np.trace(felt[0].position_covariance)) / 0.016)
    errors, stated = np.array(errors), np.array(stated)
    assert np.mean(errors > np.maximum(3 * stated, np.radians(1))) < 0.003
    assert 0.3 < np.mean((errors / stated) ** 2) < 2 and max(late, default=0) < 300


@pytest.mark.parametrize('name', sorted(PSD_METHODS))
def test_every_method_is_made_of_the_parameters(taps, name):
    finger = make_finger(FingerModel(), VALUES | {'method': name, 'radius': 0.02})
    touch = next(felt[0] for _, felt in run(finger, taps[0], 10) if felt)
    assert np.linalg.norm(touch.position) == pytest.approx(0.02)


def test_an_unknown_method_is_refused():
    with pytest.raises(BadArgument, match='map, paper'):
        make_finger(FingerModel(), VALUES | {'method': 'magic'})

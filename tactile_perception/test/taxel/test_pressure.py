# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pressures of an array, and its response to loads."""
import numpy as np
import pytest
from taxel_pictures import bar, picture

from tactile_perception._core.taxel import Hysteresis
from tactile_perception.core.calibration_file import write_calibration
from tactile_perception.core.errors import BadArgument, BadCalibration, BadFrame
from tactile_perception.taxel.calibration import fit_gains, fit_loop, fit_response
from tactile_perception.taxel.estimator import TaxelEstimator, TaxelSettings
from tactile_perception.taxel.pressure import SoftPad, TaxelArray
from tactile_perception.taxel.response import Loop, Response, read_taxels, taxel_file

OFFSET = np.random.default_rng(5).uniform(0, 20, (12, 12)).astype(np.float32)


SMALL = TaxelArray(12, 12, 1e-3)


def noisy(rng, extra=0.0, sigma=0.7):
    return OFFSET + extra + rng.normal(0, sigma, OFFSET.shape)


def estimator_of(*settings, array=SMALL, **more):
    return TaxelEstimator(array, SoftPad(), TaxelSettings('mechanics', (), *settings, **more))


def test_offsets_and_noise_are_learnt():
    estimator, rng = estimator_of(20), np.random.default_rng(0)
    for k in range(60):
        estimator.process(noisy(rng), 0.01 * k)
    assert np.abs(estimator.process(OFFSET, 1.0).pressure).max() < 0.8
    assert estimator.sigma == pytest.approx(0.7, rel=0.1)


def test_drift_is_compensated_and_a_persistent_contact_is_kept():
    estimator, rng = estimator_of(5, 2.0), np.random.default_rng(0)
    for k in range(401):
        frame = noisy(rng, 0.01 * k)
        frame[5:7, 5:7] += 50 if k > 20 else 0
        change = estimator.process(frame, 0.05 * k).pressure
    assert abs(np.median(change[:2])) < 0.8  # drifts 0.2 a second, behind by 2 s of it
    assert (change[5:7, 5:7] > 48).all()


def test_a_first_frame_that_looks_pressed_is_reported():
    hill = OFFSET.copy()
    hill[3:9, 3:9] += 100
    estimator = estimator_of(5)
    estimator.process(hill, 1.0)
    assert estimator.looks_pressed
    estimator.set_reference()
    assert not estimator.looks_pressed


@pytest.mark.parametrize(('offset', 'zero'), [(0, True), (3, False)])
def test_a_mostly_zero_first_frame_sets_the_reference_to_zero(offset, zero):
    frame = np.full(OFFSET.shape, offset, np.float32)
    frame[4:8, 4:8] = 90
    estimator = estimator_of(zeroed=True)
    assert (estimator.process(frame, 1.0).pressure[5, 5] == 90) == zero and estimator.looks_pressed != zero
    estimator.set_reference()
    assert not estimator.process(frame, 2.0).pressure.any(), 'set_reference takes what is there'


def test_the_full_scale_is_found_from_an_image():
    array, values = TaxelArray(12, 12, 1e-3, np.inf), np.full((12, 12), 300, np.uint16)
    assert np.isinf(array.scale_of(values)) and array.scale_of(values.astype(np.uint8)) == 255
    values[3, 4] = 4095
    assert array.scale_of(values) == 4095 and TaxelArray(12, 12, 1e-3, 1023.0).scale_of(values) == 1023


def test_calibrated_untouched_values_hold_when_touched_from_the_start():
    frame = OFFSET.copy()
    frame[5, 5] += 50
    assert estimator_of(response=Response(zero=OFFSET)).process(frame, 1.0).pressure[5, 5] == pytest.approx(50)


def test_wrong_settings_are_refused_by_name():
    with pytest.raises(BadArgument, match='reference_frames'):
        estimator_of(0)
    with pytest.raises(BadArgument, match='zero'):
        estimator_of(response=Response(zero=OFFSET[1:]))


def test_noise_that_looks_like_contact_everywhere_is_measured():
    """No taxel is ever quiet: noise follows from differences of frames without what all taxels share, such as a load on all."""
    estimator, rng = estimator_of(20, array=TaxelArray(12, 12, 1e-3, 4095.0)), np.random.default_rng(0)
    for k in range(41):
        estimator.process(noisy(rng, 600 + 50 * (k > 20), 12) if k else OFFSET, 0.01 * k)
    assert estimator.sigma == pytest.approx(12, rel=0.1)


@pytest.mark.parametrize('values', [np.zeros((4, 4)), np.zeros((3, 5), complex), np.zeros(15)])
def test_frame_of_another_shape_or_type_is_refused(values):
    with pytest.raises(BadFrame):
        TaxelArray(3, 5, 1e-3).frame(values)


def test_infinity_becomes_nan():
    frame = TaxelArray(1, 2, 1e-3).frame(np.array([[np.inf, 1.0]]))
    assert np.isnan(frame[0, 0]) and frame[0, 1] == 1


@pytest.mark.parametrize('wrong', [dict(rows=0), dict(columns=257), dict(pitch=0.0), dict(full_scale=0.0)])
def test_a_wrong_array_is_refused(wrong):
    with pytest.raises(BadArgument):
        TaxelArray(**{'rows': 4, 'columns': 4, 'pitch': 1e-3} | wrong)


def test_pad():
    assert SoftPad(thickness=0.002, shear_modulus=1e5).shear_stiffness == pytest.approx(5e7)
    with pytest.raises(BadArgument, match='friction'):
        SoftPad(friction=0.0)


def test_healthy_contact_has_no_dead_taxel():
    estimator, rng = estimator_of(array=TaxelArray(44, 44, 1e-3)), np.random.default_rng(1)
    for k in range(38):
        estimator.process((picture(bar()) if k > 7 else 0) + 3 + rng.normal(0, 0.7, (44, 44)), 0.01 * k)
    assert not estimator.dead.any()


def test_an_index_outside_the_array_is_refused():
    with pytest.raises(BadArgument, match='0 to 11'):
        TaxelArray(3, 4, 1e-3).dead([12])


GAIN = 1 + 0.08 * np.random.default_rng(2).normal(size=(44, 44))


def test_gains_are_recovered_from_even_loads():
    loads = np.array([20, 60, 100, 160.0])
    found = fit_gains(loads[:, None, None] * GAIN)
    assert np.abs(found / found.mean() - GAIN / GAIN.mean()).max() < 1e-3


def test_a_stamp_gives_no_gains():
    assert fit_gains(np.stack([picture(bar(), load) for load in (20, 50, 100)])) is None


def test_held_out_weights_on_a_stamp():
    truth = Response((500.0, 0.8, 2000.0), 5.0)
    changes = np.array([picture(bar(), load) for load in (10, 20, 40, 60, 80, 100.0)], np.float64)
    forces = 1e-6 * np.array([truth.pressure(image).sum() for image in changes])
    response, _ = fit_response(changes[::2], forces[::2], 1e-6)
    assert response.known
    assert [1e-6 * response.pressure(image).sum() for image in changes[1::2]] == pytest.approx(forces[1::2], rel=1e-2)


def test_one_weight_is_not_enough():
    with pytest.raises(BadCalibration, match='at least 3'):
        fit_response(np.ones((4, 3, 3)), np.full(4, 2.0), 1e-6)


@pytest.mark.parametrize('scale', [(0.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (np.nan, 0.0, 0.0), (1.0,)])
def test_a_wrong_scale_is_refused(scale):
    with pytest.raises(BadArgument):
        Response(scale)


STEP_S = 0.01
HARD, SOFT, GROWING = Loop(0.5, 4e3, 0.0, 0.5), Loop(0.12, 8e3, 0.0, 1.0), Loop(0.5, 500.0, 0.08, 1.0)
SLOW = Loop(0.1, 6e3, 0.0, 1.0, (0.03, 0.05), (0.1, 1.6))
LOOPS = pytest.mark.parametrize('loop', [HARD, SOFT, GROWING, SLOW])


def seen_and_true(loop):
    """Times, s; loads: up, held, half down, up again, zero; and the loads that a layer shows."""
    times = np.arange(0, 6, STEP_S)
    loads = np.interp(times, [0, 0.5, 1.5, 2.5, 3.0, 4.0, 4.2, 6.0], [0, 0, 5e4, 5e4, 2e4, 4e4, 0, 0])
    return times, loads, loop.shown(loads, np.full(len(times), STEP_S))


def undone(loop, seen):
    undo = Hysteresis(loop)
    return np.array([undo.undone(np.full((3, 3), value, np.float32), STEP_S)[1, 1] for value in seen])


def test_a_layer_lags_by_half_of_the_loop_and_creeps_to_a_constant_load():
    _, loads, seen = seen_and_true(HARD)
    half = 0.5 * HARD.width(5e4)
    assert loads[140] - seen[140] == pytest.approx(half, rel=0.05) and seen[295] - loads[295] == pytest.approx(half, rel=0.05)
    assert abs(loads[250] - seen[250]) < 0.2 * half


@LOOPS
def test_the_hidden_part_of_a_load_is_recovered_exactly(loop):
    _, loads, seen = seen_and_true(loop)
    found = undone(loop, seen)
    assert np.abs(seen - loads).max() > 500 and np.abs(found - loads).max() < 5


@LOOPS
def test_noise_grows_by_the_noise_gain(loop):
    rng, undo = np.random.default_rng(0), Hysteresis(loop)
    frames = rng.normal(1e4, 100, (200, 20, 20)).astype(np.float32)
    found = np.array([undo.undone(frame, STEP_S) for frame in frames])[50:]
    assert found.std(axis=0).mean() == pytest.approx(100 * loop.noise_gain, rel=0.15)
    assert Loop().noise_gain == 1 and (Hysteresis(Loop()).undone(frames[0], STEP_S) == frames[0]).all()


@LOOPS
def test_a_loop_is_fitted(loop):
    times, loads, seen = seen_and_true(loop)
    terms, weights = np.stack([seen, seen**2 * 1e-5], axis=1), np.where(loads > 0, 1e-4, 0)
    found = fit_loop(times, loads, terms, weights)
    assert found.width(5e4) == pytest.approx(loop.width(5e4), rel=0.25) and found.relaxation == pytest.approx(loop.relaxation, rel=0.9)
    assert sum(found.late) == pytest.approx(sum(loop.late), abs=0.01)
    again = found.shown(loads, np.full(len(times), STEP_S))
    assert np.abs(again - seen).max() < 0.3 * np.abs(seen - loads).max()


def test_no_loop_is_fitted_to_noise():
    times, loads, _ = seen_and_true(HARD)
    noisy = loads + np.random.default_rng(0).normal(0, 500, len(loads))
    assert fit_loop(times, loads, np.maximum(noisy, 0)[:, None], np.where(loads > 0, 1e-4, 0)) == Loop()


def test_impossible_loops_are_refused():
    for numbers in ((0.95, 1.0), (-0.1, 1.0), (0.5, -1.0), (0.5, np.inf), (0.5, 1.0, 1.5), (0.5, 1.0, 0.0, 0.0), (np.nan, 1.0),
                    (0.1, 1.0, 0.0, 1.0, (0.1,)), (0.1, 1.0, 0.0, 1.0, (0.5, 0.45), (1.0, 2.0)), (0.1, 1.0, 0.0, 1.0, (0.1,), (0.0,))):
        with pytest.raises(BadArgument, match='loop'):
            Loop(*numbers)


ARRAY = TaxelArray(3, 4, 1e-3)
RESPONSE = Response((400.0, 0.3, 150.0), 12.5, np.linspace(0.9, 1.1, 12).reshape(3, 4), True, np.arange(12.0).reshape(3, 4),
                    Loop(0.25, 1750.0, 0.04, 0.4, (0.02, 0.01), (0.1, 1.6)))


@pytest.fixture
def path(tmp_path):
    write_calibration(tmp_path / 'c.yaml', taxel_file(RESPONSE, {'held_out_force_mean': 0.03}, {'force': [1.0, 9.0]}, []))
    return tmp_path / 'c.yaml'


def test_a_written_response_is_read_back(path):
    found = read_taxels(path, ARRAY)
    assert found.scale == pytest.approx(RESPONSE.scale) and found.knee == 12.5 and found.known
    assert found.loop == RESPONSE.loop
    assert found.gain == pytest.approx(RESPONSE.gain, rel=1e-6) and found.zero == pytest.approx(RESPONSE.zero)


def test_another_array_and_broken_numbers_are_refused(path):
    with pytest.raises(BadCalibration, match='3 x 4'):
        read_taxels(path, TaxelArray(4, 4, 1e-3))
    for old, new in (('400.0', '.nan'), ('150.0', '-150.0'), ('knee: 12.5', 'knee: 0.0'), ('share: 0.25', 'share: 2.0'),
                     ('share: 0.25', 'part: 0.25')):
        broken = path.with_name('broken.yaml')
        broken.write_text(path.read_text().replace(old, new, 1))
        with pytest.raises(BadCalibration):
            read_taxels(broken, ARRAY)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception.core.errors import BadArgument
from tactile_perception.dots.reference import CalibratedRest, Reference, rest_warning

ROW, COLUMN = np.divmod(np.arange(100), 10)
ID, UV, SIGMA = np.arange(100), np.stack([COLUMN, ROW], axis=1) * 20.0 + 30, np.full(100, 0.02)
DENT = 3.0 * np.exp(-((UV - 120) ** 2).sum(axis=1, keepdims=True) / (2 * 40**2)) * [1, 0]


def run(reference, frames, start=0.0, move=0.0, touched=None, rate=50.0, noise=0.02, seed=0):
    """Feeds frames of UV + move(k); the last displacements."""
    rng = np.random.default_rng(seed)
    for k in range(frames):
        now = UV + (move(k) if callable(move) else move) + rng.normal(0, noise, UV.shape)
        duv = reference.update(ID, now, SIGMA, start + k / rate, 10, touched)
    return duv


def test_first_frames_are_averaged():
    reference = Reference(frames=16)
    run(reference, 16)
    assert np.sqrt(np.mean((reference.uv - UV) ** 2)) < 0.02 / 4 * 1.2


@pytest.mark.full
def test_what_a_touch_leaves_behind_is_followed_slowly():
    reference = Reference(time_constant_s=10.0)
    run(reference, 20)
    run(reference, 100, start=1.0, move=2 * DENT)
    run(reference, 100, start=3.0, move=0.08 * 2 * DENT)  # 0.5 px stay for ever
    assert reference.touched
    run(reference, 500, start=5.0, move=0.08 * 2 * DENT)
    assert not reference.touched
    duv = run(reference, 2000, start=15.0, move=0.08 * 2 * DENT)
    assert np.linalg.norm(duv, axis=1).max() < 0.12


def test_after_a_residue_the_next_touch_freezes_at_once():
    reference = Reference(time_constant_s=10.0)
    run(reference, 20)
    run(reference, 100, start=1.0, move=2 * DENT)
    run(reference, 500, start=3.0, move=0.08 * 2 * DENT)
    assert not reference.touched
    before = reference.uv.copy()
    run(reference, 1, start=13.01, move=0.3 * DENT)
    assert reference.touched
    np.testing.assert_array_equal(reference.uv, before)


@pytest.mark.full
@pytest.mark.parametrize('deepest, held', [(0.15, 0.15), (0.5, 0.5), (1.0, 1.0), (1.0, 0.5)])
def test_a_contact_that_is_held_stays_frozen(deepest, held):
    reference = Reference(time_constant_s=1.0)
    run(reference, 20)
    run(reference, 50, start=1.0, move=lambda k: deepest * DENT * k / 50)
    before = reference.uv.copy()
    run(reference, 3000, start=2.0, move=held * DENT)  # a minute, the lightest of 0.45 px
    assert reference.touched
    np.testing.assert_array_equal(reference.uv, before)


def test_slow_drift_is_followed():
    reference = Reference(time_constant_s=1.0)
    run(reference, 20)
    swelling = (UV - 120) * 0.002
    duv = run(reference, 1000, start=1.0, move=lambda k: swelling * k / 1000)
    assert not reference.touched
    assert np.abs(duv).max() < 0.12  # 0.25 px of drift at the corners


def test_a_press_does_not_move_the_reference_of_a_detector_that_states_no_noise():
    reference, rng, unknown = Reference(), np.random.default_rng(1), np.full(100, np.nan)
    for k in range(5):  # fewer than are averaged
        reference.update(ID, UV + rng.normal(0, 0.02, UV.shape), unknown, k / 50, 10)
    assert not reference.touched
    before = reference.uv.copy()
    narrow = 3.0 * np.exp(-((UV - 120) ** 2).sum(axis=1, keepdims=True) / (2 * 20**2)) * [1, 0]  # a tenth of the dots move
    duv = reference.update(ID, UV + rng.normal(0, 0.02, UV.shape) + narrow, unknown, 0.1, 10)
    assert reference.touched
    np.testing.assert_array_equal(reference.uv, before)
    assert np.abs(duv - narrow).max() < 0.15


def test_a_later_stage_may_say_that_something_touches():
    reference = Reference()
    run(reference, 5)
    before = reference.uv.copy()
    run(reference, 50, start=1.0, move=0.05, touched=True)
    np.testing.assert_array_equal(reference.uv, before)


def test_a_dot_seen_late_gets_its_place_when_untouched():
    reference = Reference()
    reference.update(ID[1:], UV[1:], SIGMA[1:], 0.0, 10)
    duv = reference.update(ID, UV + DENT, SIGMA, 0.1, 10)
    assert np.isnan(duv[0]).all() and np.isfinite(duv[1:]).all()
    assert np.isfinite(reference.update(ID, UV, SIGMA, 0.2, 10)).all()


def test_taken_while_pressed_is_suspicious_until_taken_anew():
    reference = Reference()
    run(reference, 1, move=DENT)
    assert 'set_reference' in reference.warning
    reference.reset()
    run(reference, 1, start=1.0)
    assert reference.warning == ''


def test_wrong_parameters():
    with pytest.raises(BadArgument, match='time_constant_s'):
        Reference(time_constant_s=0.0)


def test_a_camera_that_has_not_moved_adds_the_calibrated_places_to_the_first_frames():
    reference, alone = Reference(frames=1, known=CalibratedRest(UV)), Reference(frames=1)
    barely = DENT / 100  # a tip that has just begun to press when the only untouched frame is taken: 0.03 px
    for each in (reference, alone):
        run(each, 1, move=barely)
    assert np.sqrt(np.mean((alone.uv - UV)**2)) > 0.02
    assert np.sqrt(np.mean((reference.uv - UV)**2)) < 0.003


def test_without_a_calibrated_place_a_late_dot_gets_its_own():
    rest = UV.copy()
    rest[7] = np.nan
    reference = Reference(known=CalibratedRest(rest))
    run(reference, 20)
    assert np.abs(reference.uv[7] - UV[7]).max() < 0.02 and len(reference.id) == 100


def test_dots_that_come_later_are_judged_with_the_others():
    reference, half = Reference(known=CalibratedRest(UV)), COLUMN < 5
    for k in range(12):
        reference.update(ID[half], UV[half], SIGMA[half], k / 50, 10)
    assert reference.warning == ''
    shift = 4.0 * np.exp(-((UV - [190, 120]) ** 2).sum(axis=1, keepdims=True) / (2 * 30**2)) * [1, 0]
    shift[half] = 0.0
    duv = reference.update(ID, UV + shift, SIGMA, 0.5, 10)
    assert 'touched when the reference was taken' in reference.warning
    np.testing.assert_allclose(duv, shift, atol=0.05, err_msg='the calibrated positions are the reference meanwhile')
    duv = reference.update(ID, UV, SIGMA, 0.6, 10)
    assert reference.warning == '' and np.abs(duv).max() < 0.05, 'taken again by itself'


SHEET_ID = np.arange(117)
SHEET = np.stack(np.divmod(SHEET_ID, 13)[::-1], axis=1) * 40.0 + 80
MIDDLE = SHEET.mean(axis=0)
KNOWN = CalibratedRest(SHEET)


def press(middle, size, width=100.0):
    """A press's displacements, px: outwards from the image's middle, most beside the middle pressed."""
    bell = np.exp(-((SHEET - middle)**2).sum(axis=1) / (2 * width**2))
    return size * bell[:, None] * (SHEET - MIDDLE) / 150 + 0.2 * size * bell[:, None] * (SHEET - middle) / width


def noise(size, seed=0):
    return np.random.default_rng(seed).normal(0, size, SHEET.shape)


@pytest.mark.parametrize('moved', [0.0, [3.0, -2.0], (SHEET - MIDDLE) * 0.02, (SHEET - MIDDLE)[:, ::-1] * [0.03, -0.03], noise(0.5, 1)],
                         ids=['still', 'shifted', 'swollen', 'turned', 'another print'])
def test_what_is_no_press_is_none(moved):
    for seed in range(20):
        judged = KNOWN.judge(SHEET_ID, SHEET + moved + noise(0.05, seed))
        assert not judged.pressed and judged.reason == ''


@pytest.mark.parametrize('middle', [(140.0, 120.0), (330.0, 250.0), (520.0, 200.0)])
@pytest.mark.parametrize('size', [1.0, 5.0, 15.0])
def test_a_press_is_one_and_the_calibrated_positions_hold(middle, size):
    judged = KNOWN.judge(SHEET_ID, SHEET + press(middle, size) + noise(0.05))
    assert judged.pressed and judged.known and 'was touched' in judged.reason


def test_dots_that_are_missing_or_unknown_are_left_out():
    rest = SHEET.copy()
    rest[:40] = np.nan
    seen = np.r_[20:110]
    now = SHEET + press((330.0, 250.0), 5.0)
    now[100] = np.nan
    assert CalibratedRest(rest).judge(SHEET_ID[seen], now[seen]).pressed
    assert not CalibratedRest(rest).judge(np.r_[SHEET_ID[:60], 300], np.vstack([now[:60], [[0, 0]]])).pressed, 'of twenty nothing is said'


def dome(rows=23, columns=23, pitch=18.0, printing=0.05, seed=0):
    """A printed dome seen by a tilted camera: id, uv with printing errors of so many pitches, and row and column from the middle."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    p = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1)
    seen = p * (1.1 - 0.1 * (p**2).sum(axis=1, keepdims=True) / (rows / 2) ** 2) / (1 + 0.004 * p[:, 1:])
    return np.arange(rows * columns), pitch * (seen + np.random.default_rng(seed).normal(0, printing / 2, p.shape)) + 240, p


@pytest.mark.parametrize('seed', range(10))
def test_untouched(seed):
    id, uv, _ = dome(seed=seed)
    assert rest_warning(id, uv, 23) == ''


@pytest.mark.parametrize('middle', [(0.0, 0.0), (4.0, 0.0), (-3.0, 5.0)])
def test_a_press_of_a_quarter_pitch(middle):
    id, uv, p = dome()
    away = p - middle
    pressed = uv + 18.0 * 0.25 * away / 2.5 * np.exp(0.5 - (away**2).sum(axis=1, keepdims=True) / (2 * 2.5**2))
    assert 'set_reference' in rest_warning(id, pressed, 23)


def fish_eye(rows, columns, tilt, seed):
    """A flat grid at a tilt, degrees, seen through a lens that shows angles as distances: id, uv, and row and column from the middle."""
    rng, (row, column) = np.random.default_rng(seed), np.divmod(np.arange(rows * columns), columns)
    p = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1)
    turn, tilt, half = rng.uniform(0, 2 * np.pi), np.radians(tilt), max(rows, columns) / 2
    along = np.array([np.cos(turn), np.sin(turn)])
    flat = p - np.outer(p @ along, along) * (1 - np.cos(tilt))
    ray = flat / (2 * half + (p @ along) * np.sin(tilt))[:, None] + rng.uniform(-0.1, 0.1, 2)
    far = np.hypot(*ray.T)[:, None]
    seen = np.arctan(far) / far * ray * 2 * half * 30
    return np.arange(rows * columns), seen + 300 + rng.normal(0, 0.3, p.shape), p


@pytest.mark.parametrize('rows, columns', [(7, 9), (14, 10), (8, 13)])
@pytest.mark.parametrize('tilt', [0, 20, 35])
def test_an_oblique_view_through_a_fish_eye_is_no_touch_and_a_press_in_it_is(rows, columns, tilt):
    for seed in range(4):
        id, uv, p = fish_eye(rows, columns, tilt, seed)
        assert rest_warning(id, uv, columns) == ''
        away = p - np.random.default_rng(seed).uniform(-2, 2, 2)
        pressed = uv + 30 * 0.4 * away / 1.5 * np.exp(0.5 - (away**2).sum(axis=1, keepdims=True) / (2 * 1.5**2))
        assert 'set_reference' in rest_warning(id, pressed, columns)


def test_too_few_dots_to_tell():
    id, uv, _ = dome(5, 5)
    assert rest_warning(id, uv, 5) == ''

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.reference.calibrated_rest import CalibratedRest
from tactile_perception.dots.reference.drift import Reference
from tactile_perception.errors import BadArgument

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


def test_no_motion_gives_no_displacement():
    reference = Reference()
    run(reference, 20)
    duv = reference.update(ID, UV, SIGMA, 1.0, 10)
    assert np.abs(duv).max() < 0.03
    assert not reference.touched


def test_a_touch_is_noticed_and_freezes():
    reference = Reference(time_constant_s=0.1)
    run(reference, 20)
    before = reference.uv.copy()
    duv = run(reference, 100, start=1.0, move=DENT)
    assert reference.touched
    np.testing.assert_array_equal(reference.uv, before)
    assert np.abs(duv - DENT).max() < 0.12


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


@pytest.mark.parametrize('held', [0.15, 0.5, 1.0])
def test_a_contact_that_is_held_stays_frozen(held):
    reference = Reference(time_constant_s=1.0)
    run(reference, 20)
    run(reference, 50, start=1.0, move=lambda k: held * DENT * k / 50)
    before = reference.uv.copy()
    run(reference, 3000, start=2.0, move=held * DENT)  # a minute, the lightest of 0.45 px
    assert reference.touched
    np.testing.assert_array_equal(reference.uv, before)


def test_a_contact_held_at_half_of_its_depth_stays_frozen():
    reference = Reference(time_constant_s=1.0)
    run(reference, 20)
    run(reference, 50, start=1.0, move=DENT)
    before = reference.uv.copy()
    run(reference, 1000, start=2.0, move=0.5 * DENT)
    assert reference.touched
    np.testing.assert_array_equal(reference.uv, before)


def test_slow_drift_is_followed():
    reference = Reference(time_constant_s=1.0)
    run(reference, 20)
    swelling = (UV - 120) * 0.002
    duv = run(reference, 1000, start=1.0, move=lambda k: swelling * k / 1000)
    assert not reference.touched
    assert np.abs(duv).max() < 0.12  # 0.25 px of drift at the corners


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


def test_restart():
    reference = Reference()
    run(reference, 5)
    reference.restart()
    assert np.abs(reference.update(ID, UV + 7, SIGMA, 1.0, 10)).max() == 0


def test_taken_while_pressed_is_suspicious_until_taken_anew():
    reference = Reference()
    run(reference, 1, move=DENT)
    assert 'set_reference' in reference.suspicious
    reference.restart()
    run(reference, 1, start=1.0)
    assert reference.suspicious == ''


def test_wrong_parameters():
    with pytest.raises(BadArgument, match='time_constant_s'):
        Reference(time_constant_s=0.0)


def test_a_touch_at_the_start_is_told_by_the_calibrated_places():
    reference = Reference(known=CalibratedRest(UV))
    duv = run(reference, 20, move=2 * DENT)
    assert reference.touched and 'was touched' in reference.suspicious
    assert np.abs(duv - 2 * DENT).max() < 0.12
    run(reference, 20, start=1.0, move=0.7)
    assert reference.suspicious == '' and not reference.touched, 'released, though the camera has drifted since it was calibrated'
    assert np.abs(reference.uv - UV - 0.7).max() < 0.05


def test_a_touch_at_the_start_beside_a_camera_that_has_moved_is_told_until_it_ends():
    reference = Reference(known=CalibratedRest(UV))
    run(reference, 5, move=2 * DENT + [6.0, 0.0])
    assert 'calibrate again' in reference.suspicious
    run(reference, 5, start=1.0, move=np.array([6.0, 0.0]))
    assert reference.suspicious == '' and np.abs(reference.uv - UV - [6.0, 0.0]).max() < 0.1


def test_an_untouched_start_is_taken_where_it_is():
    reference = Reference(known=CalibratedRest(UV))
    run(reference, 10, move=np.array([1.0, -1.0]))
    assert reference.suspicious == '' and np.abs(reference.uv - UV - [1.0, -1.0]).max() < 0.05


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
    assert reference.suspicious == ''
    shift = 4.0 * np.exp(-((UV - [190, 120]) ** 2).sum(axis=1, keepdims=True) / (2 * 30**2)) * [1, 0]
    shift[half] = 0.0
    duv = reference.update(ID, UV + shift, SIGMA, 0.5, 10)
    assert 'touched when the reference was taken' in reference.suspicious
    np.testing.assert_allclose(duv, shift, atol=0.05, err_msg='the calibrated positions are the reference meanwhile')
    duv = reference.update(ID, UV, SIGMA, 0.6, 10)
    assert reference.suspicious == '' and np.abs(duv).max() < 0.05, 'taken again by itself'

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from taxel_pictures import bar, picture
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.taxel.pressure import Baseline, DeadTaxels, SoftPad, TaxelArray, fill

OFFSET = np.random.default_rng(5).uniform(0, 20, (12, 12)).astype(np.float32)
UNTOUCHED = np.zeros(OFFSET.shape, bool)


def noisy(rng, extra=0.0):
    return (OFFSET + extra + rng.normal(0, 0.7, OFFSET.shape)).astype(np.float32)


def test_offsets_are_learnt_and_the_noise_known():
    baseline, rng = Baseline(20, 30.0), np.random.default_rng(0)
    for _ in range(60):
        baseline.follow(baseline.change(noisy(rng)), UNTOUCHED, 0.01)
    assert np.abs(baseline.values - OFFSET).max() < 0.8
    assert baseline.sigma == pytest.approx(0.7, rel=0.1)


def test_drift_is_followed_and_a_lasting_contact_is_not_eaten():
    baseline, rng = Baseline(5, 2.0), np.random.default_rng(0)
    touched = np.zeros(OFFSET.shape, bool)
    touched[5, 5] = True
    for k in range(400):
        drift = 0.01 * k
        frame = noisy(rng, drift)
        frame[5, 5] += 50 if k > 20 else 0
        baseline.follow(baseline.change(frame), touched if k > 20 else UNTOUCHED, 0.05)
    change = baseline.change(noisy(rng, 4.0))
    assert abs(np.median(change[:2])) < 0.8  # drifts 0.2 a second, behind by 2 s of it
    frame = noisy(rng, 4.0)
    frame[5, 5] += 50
    assert baseline.change(frame)[5, 5] > 50


def test_first_frame_that_looks_pressed_is_said():
    hill = OFFSET.copy()
    hill[3:9, 3:9] += 100
    baseline = Baseline(5, 30.0, full_scale=255.0)
    baseline.change(hill)
    assert 'set_reference' in baseline.warning
    baseline.reset()
    assert baseline.warning == ''


def test_start_of_calibration_holds_though_touched_from_the_first():
    frame = OFFSET.copy()
    frame[5, 5] += 50
    assert Baseline(5, 30.0, OFFSET).change(frame)[5, 5] == pytest.approx(50)


def test_wrong_numbers():
    with pytest.raises(BadArgument):
        Baseline(0, 1.0)


def test_noise_that_looks_like_touch_everywhere_is_known_all_the_same():
    """No taxel is ever quiet: the differences of frames tell, but for what all have in common, as a load on all."""
    baseline, rng, touched = Baseline(20, 30.0), np.random.default_rng(0), np.ones(OFFSET.shape, bool)
    for k in range(40):
        noise = rng.normal(0, 12, OFFSET.shape).astype(np.float32)
        baseline.follow(baseline.change(OFFSET + np.float32(50 * (k > 20)) + noise), touched, 0.01)
    assert baseline.sigma == pytest.approx(12, rel=0.1)


@pytest.mark.parametrize('values', [np.zeros((4, 4)), np.zeros((3, 5), complex), np.zeros(15)])
def test_frame_of_another_shape_or_type_is_refused(values):
    with pytest.raises(BadFrame):
        TaxelArray(3, 5, 1e-3).frame(values)


def test_infinity_becomes_nan():
    frame = TaxelArray(1, 2, 1e-3).frame(np.array([[np.inf, 1.0]]))
    assert np.isnan(frame[0, 0]) and frame[0, 1] == 1


@pytest.mark.parametrize('wrong', [dict(rows=0), dict(columns=257), dict(pitch=0.0), dict(full_scale=0.0)])
def test_wrong_array(wrong):
    with pytest.raises(BadArgument):
        TaxelArray(**{'rows': 4, 'columns': 4, 'pitch': 1e-3} | wrong)


def test_pad():
    assert SoftPad(thickness=0.002, shear_modulus=1e5).shear_stiffness == pytest.approx(5e7)
    with pytest.raises(BadArgument, match='friction'):
        SoftPad(friction=0.0)


def test_all_dead_is_zero():
    assert not fill(np.ones((3, 3), np.float32), np.ones((3, 3), bool)).any()


def test_healthy_contact_has_no_dead_taxel():
    dead = DeadTaxels(np.zeros((44, 44), bool))
    rng = np.random.default_rng(1)
    for _ in range(30):
        dead.repaired(picture(bar()) + rng.normal(0, 0.7, (44, 44)).astype(np.float32), 0.7)
    assert not dead.dead.any()


def test_number_of_no_taxel():
    with pytest.raises(BadArgument, match='0 to 11'):
        TaxelArray(3, 4, 1e-3).dead([12])

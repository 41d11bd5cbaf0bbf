# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled part: it takes any array, can be copied, is as it was after an exception, and agrees with SciPy and plain sweeps."""
import copy

import numpy as np
import pytest
from border_checks import arrays_test

from tactile_perception._core import taxel

PRESSURE = np.pad(np.full((9, 12), 3e4, np.float32), 6)
TOUCHED = PRESSURE > 1e4
RULE = {'smooth': 1.0, 'reach': 2, 'least': 100.0, 'share': 0.6, 'ramp': 0.33}
KEY = taxel.Keyframe(PRESSURE, scale=1 / 3e4, steep=0.08)


def shear(shape=PRESSURE.shape):
    return taxel.SurfaceShear(rows=shape[0], columns=shape[1], pitch=1e-3, thickness=2.0, stiffness=5e7)


def path():
    return taxel.Path(window=0.2, reported=0.06, least_noise=1e-5, bound=2.5)


def fit_of(key, pressure=PRESSURE, guess=np.zeros(4)):
    found = key.motion(pressure, scale=1 / 3e4, turns=True, guess=guess)
    return found.fit, np.array([found.spread])


def regions(score, pressure, full):
    found = taxel.find_regions(score, pressure, full, level=0.5, reach=1, around=2, most=64, least=0.25, pitch=1e-3)
    return [found.labels, found.near] + [np.array([one.force, one.peak, one.moments.area, *one.moments.second]) for one in found.all]


#: How a function or class is called here, and an example of each of its arrays.
CALLS = {
    'contact_score': (lambda pressure=PRESSURE, full=TOUCHED: [taxel.contact_score(pressure, full, **RULE)],
                      {'pressure': PRESSURE, 'full': TOUCHED}),
    'find_regions': (lambda score=TOUCHED.astype(np.float32), pressure=PRESSURE, full=TOUCHED: regions(score, pressure, full),
                     {'score': TOUCHED.astype(np.float32), 'pressure': PRESSURE, 'full': TOUCHED}),
    'add': (lambda pose=np.zeros(3), arm=np.ones(2): [path().add(1.0, pose, arm, 1.0).pose], {'pose': np.zeros(3), 'arm': np.ones(2)}),
    'Keyframe': (lambda pressure=PRESSURE: [taxel.Keyframe(pressure, scale=1 / 3e4, steep=0.08).normal],
                 {'pressure': PRESSURE}),
    'motion': (lambda pressure=PRESSURE, guess=np.zeros(4): fit_of(KEY, pressure, guess), {'pressure': PRESSURE, 'guess': np.zeros(4)}),
    'move': (lambda touched=TOUCHED, pressure=PRESSURE, shift=np.array([1e-4, 0, 0.01]): [
        shear().move(touched, pressure, shift, 0.6)], {'touched': TOUCHED, 'pressure': PRESSURE, 'shift': np.array([1e-4, 0, 0.01])}),
    'pressure_of': (lambda traction=np.stack([PRESSURE, -PRESSURE]): [shear().pressure_of(traction)],
                    {'traction': np.stack([PRESSURE, -PRESSURE])}),
}


test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory = arrays_test(CALLS)


def test_a_copy_goes_on_by_itself_and_an_exception_changes_nothing():
    first, motion = shear(), np.array([1e-4, 0.0, 0.0])
    first.move(TOUCHED, PRESSURE, motion, 0.6)
    force, other = first.force, copy.deepcopy(first)
    other.move(TOUCHED, PRESSURE, motion, 0.6)
    with pytest.raises(ValueError, match='friction'):
        first.move(TOUCHED, PRESSURE, motion, np.nan)
    assert (first.force == force).all() and other.force[0] > 1.5 * force[0]
    for one, again in zip(fit_of(KEY), fit_of(copy.copy(KEY))):
        np.testing.assert_array_equal(one, again)


def test_nothing_has_no_edges_and_a_guess_without_a_number_stays_one():
    assert taxel.Keyframe(np.zeros((44, 44), np.float32), scale=1.0, steep=0.08).count == 0
    fit, (spread,) = fit_of(KEY, guess=np.full(4, np.nan))
    assert np.isnan(fit).any() and not spread < 1


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, -5.0])
def test_what_is_no_pressure_has_scores_of_0_to_1(value):
    image = PRESSURE.copy()
    image[8:11, 3:9] = value
    score = taxel.contact_score(image, np.zeros(image.shape, bool), **RULE)
    assert ((score >= 0) & (score <= 1)).all()
    assert not taxel.contact_score(np.full((9, 9), np.nan, np.float32), np.ones((9, 9), bool), **RULE).any()


def test_the_border_of_a_face_that_is_about_as_curved_as_flat_does_not_jump():
    y, x = np.mgrid[-12:13, -12:13]
    noise = np.random.default_rng(3).normal(0, 1500, y.shape)
    scores = []
    for bend in np.linspace(0, 200, 101):
        face = np.where((abs(x) < 9) & (abs(y) < 6), 3e4 + bend * x * y + noise, 0).astype(np.float32)
        scores.append(taxel.contact_score(face, np.zeros(face.shape, bool), **RULE | {'least': 1e3}))
    assert max(np.abs(b - a).max() for a, b in zip(scores[:-1], scores[1:])) < 0.05


def test_a_stop_is_seen_within_two_frames_and_one_frame_has_no_velocity():
    rng, line = np.random.default_rng(0), path()
    first = line.add(0.0, np.array([2e-3, 3e-3, 0.1]), np.zeros(2), 7e-3)
    assert first.used == 1 and not first.velocity.any() and first.sigma > 1e300 and np.isnan(first.reported).all()
    line.reset()
    for k in range(20):
        found = line.add(k / 100, np.array([0.02 * min(k, 17), 0.0, 0.0]) + rng.normal(0, 1e-3, 3) * [1, 1, 0], np.zeros(2), 7e-3)
    assert found.velocity[0] == pytest.approx(0, abs=0.4)

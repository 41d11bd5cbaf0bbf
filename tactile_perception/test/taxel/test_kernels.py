# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernels: they accept any array, can be copied, keep their state on an exception, and agree with SciPy and plain sweeps."""
import copy

import numpy as np
import pytest
from border_checks import arrays_test

from tactile_perception._core import taxel

PRESSURE = np.pad(np.full((9, 12), 3e4, np.float32), 6)
TOUCHED = PRESSURE > 1e4
PAD = taxel.Pad(rows=PRESSURE.shape[0], columns=PRESSURE.shape[1], pitch=1e-3, thickness=2.0, stiffness=5e7, friction=0.6)


def shear():
    return taxel.SurfaceShear(PAD)


def regions(score, pressure, full):
    found = taxel.find_regions(score, pressure, full, pitch=1e-3, reach=2.0)
    return [found.labels, found.near] + [np.array([one.force, one.peak, *one.integrals]) for one in found.all]


def tracked(pressure=PRESSURE, touched=TOUCHED, seen=PRESSURE):
    motion = taxel.MotionTracker(PAD).process(pressure, touched, seen, 20.0, 1.0)
    return [motion.slipping, motion.step]


#: How a function or class is called here, and an example of each of its arrays.
CALLS = {
    'contact_score': (lambda pressure=PRESSURE, full=TOUCHED: [taxel.contact_score(pressure, full, 2.0, 10.0)],
                      {'pressure': PRESSURE, 'full': TOUCHED}),
    'find_regions': (lambda score=TOUCHED.astype(np.float32), pressure=PRESSURE, full=TOUCHED: regions(score, pressure, full),
                     {'score': TOUCHED.astype(np.float32), 'pressure': PRESSURE, 'full': TOUCHED}),
    'move': (lambda touched=TOUCHED, pressure=PRESSURE, shift=np.array([1e-4, 0, 0.01]): [
        shear().move(touched, pressure, shift)], {'touched': TOUCHED, 'pressure': PRESSURE, 'shift': np.array([1e-4, 0, 0.01])}),
    'pressure_centre': (lambda pressure=PRESSURE, touched=TOUCHED: [shear().pressure_centre(pressure, touched, [1.0, 2.0])],
                        {'pressure': PRESSURE, 'touched': TOUCHED}),
    'MotionTracker': (tracked, {'pressure': PRESSURE, 'touched': TOUCHED, 'seen': PRESSURE}),
}


test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory = arrays_test(CALLS)


def test_copies_are_independent_and_an_exception_changes_nothing():
    first, motion = shear(), np.array([1e-4, 0.0, 0.0])
    first.move(TOUCHED, PRESSURE, motion)
    force, other = first.force, copy.deepcopy(first)
    other.move(TOUCHED, PRESSURE, motion)
    with pytest.raises(ValueError, match='pressure'):
        first.move(TOUCHED, PRESSURE[1:], motion)
    assert (first.force == force).all() and other.force[0] > 1.5 * force[0]
    with pytest.raises(ValueError, match='friction'):
        taxel.Pad(rows=2, columns=2, pitch=1e-3, thickness=2.0, stiffness=5e7, friction=np.nan)


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, -5.0])
def test_extreme_pressures_have_scores_from_0_to_1(value):
    image = PRESSURE.copy()
    image[8:11, 3:9] = value
    score = taxel.contact_score(image, np.zeros(image.shape, bool), 2.0, 10.0)
    assert ((score >= 0) & (score <= 1)).all()
    assert not taxel.contact_score(np.full((9, 9), np.nan, np.float32), np.ones((9, 9), bool), 2.0, 10.0).any()


def test_the_border_of_a_slightly_curved_face_does_not_jump():
    y, x = np.mgrid[-12:13, -12:13]
    noise = np.random.default_rng(3).normal(0, 1500, y.shape)
    scores = []
    for bend in np.linspace(0, 200, 101):
        face = np.where((abs(x) < 9) & (abs(y) < 6), 3e4 + bend * x * y + noise, 0).astype(np.float32)
        scores.append(taxel.contact_score(face, np.zeros(face.shape, bool), 2.0, 100.0))
    assert max(np.abs(b - a).max() for a, b in zip(scores[:-1], scores[1:])) < 0.05

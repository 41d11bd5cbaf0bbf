# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which touch is which, what was missed and made up, and whether covariances are consistent."""

import numpy as np
import pytest
from tactile_perception.evaluation.evaluation import TouchCounts, pairs, touch_errors

from made import contact


def counted(frames):
    counts = TouchCounts()
    for k, (reported, true) in enumerate(frames):
        counts.add(0.1 * k, reported, true, pairs(reported, true))
    return counts


def test_pairs_lie_nearest_in_all():
    reported, true = [contact(0, 0, id=5), contact(9e-3, 0, id=6)], [contact(10e-3, 0, id=1), contact(1e-3, 0, id=2),
                                                                     contact(0.05, 0, id=3)]
    assert sorted((t.id, r.id) for t, r in pairs(reported, true)) == [(5, 2), (6, 1)]
    assert pairs([], true) == [] and len(pairs(reported, [contact(np.nan, 0)])) == 1


def test_errors_of_one_touch():
    tilted = (0.0, np.sin(0.1), np.cos(0.1))
    found = touch_errors(contact(3e-4, 4e-4, 1.1e-3, force=1.5, normal=tilted), contact(0, 0))
    assert found == pytest.approx({'place': 5e-4, 'depth': 1e-4, 'normal': 0.1, 'touch_force': -0.5})


def test_what_is_not_true_is_not_judged_and_what_is_not_reported_is_nan():
    found = touch_errors(contact(0, 0, force=np.nan), contact(0, 0, np.nan, normal=[np.nan] * 3))
    assert set(found) == {'place', 'touch_force'} and np.isnan(found['touch_force'])


def test_without_a_depth_the_place_is_one_in_space():
    reported = contact(3e-4, 0, np.nan)
    reported.position[2] = -1e-3 + 4e-4
    assert touch_errors(reported, contact(0, 0))['place'] == pytest.approx(5e-4)


def test_frames_and_touches_are_counted():
    here, other = contact(0, 0), contact(0.02, 0, id=2)
    found = counted([([here], []), ([here], []), ([], []), ([], [here]), ([here], [here]), ([contact(0, 0, id=7)], [here]),
                     ([here], [here, other]), ([here, contact(0.02, 0, id=9)], [here]), ([contact(0, 0, id=8)], [])]).summary()
    assert found['frames'] == {'judged': 9, 'touched': 5, 'missed': 1, 'too_few': 1, 'too_many': 1, 'untouched': 4, 'false': 3}
    assert {name: found['touches'][name] for name in ('there', 'never_reported', 'made_up', 'renumbered')} == {
        'there': 2, 'never_reported': 1, 'made_up': 2, 'renumbered': 2}
    assert found['touches']['reported_after_ms']['median'] == pytest.approx(100)


@pytest.mark.parametrize('factor, mean, within', [(1.0, 1.0, 0.95), (2.0, 0.25, 1.0), (0.5, 4.0, 0.42)])
def test_covariances_that_are_too_large_or_small_are_seen(factor, mean, within):
    rng = np.random.default_rng(1)
    frames = []
    for _ in range(1500):
        reported = contact(0, 0, sigma=1e-4 * factor)
        reported.position[:] += 1e-4 * rng.normal(size=3)
        frames.append(([reported], [contact(0, 0)]))
    found = counted(frames).consistency()
    assert found['mean'] == pytest.approx(mean, rel=0.08) and found['within_95'] == pytest.approx(within, abs=0.02)


def test_without_covariances_nothing_is_said_of_them():
    assert counted([([contact(0, 0, sigma=np.nan)], [contact(0, 0)])]).consistency() == {'count': 0, 'not_stated': 1}

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Errors of made-up recordings, by hand."""

import numpy as np
import pytest
from tactile_perception.evaluation.evaluation import Evaluation, Instant

from made import contact, region, slip

WRENCH = np.array([0.0, 0.0, -2.0, 0.01, 0.0, 0.0])


def summed(*frames):
    evaluation = Evaluation()
    for k, (reported, true) in enumerate(frames):
        evaluation.add(float(k), reported, true)
    return evaluation.summary()


def test_each_error_in_its_unit():
    reported = Instant([contact(1e-3, 0, 1.2e-3)], region(11e-3, [1, 1, 2, 0], (1e-3, 0)), slip(1, 0.4, 3e-3), 1.1 * WRENCH)
    true = Instant([contact(0, 0, 1e-3)], region(10e-3, [1, 1, 2, 2]), slip(1, 0.5, 1e-3), WRENCH)
    errors = summed((reported, true))['errors']
    middle = {name: found['median'] for name, found in errors.items()}
    assert middle.pop('region_overlap') == pytest.approx(95 / (121 + 100 - 95), abs=0.02), 'of 9.5 mm by 10 mm'
    assert middle == pytest.approx({'place': 1, 'depth': 0.2, 'normal': 0, 'touch_force': 0, 'region_area': 21, 'region_centroid': 1,
                                    'slipping_fraction': 10, 'slip_velocity': 2, 'force': 0.2, 'force_relative': 10, 'moment': 1,
                                    'moment_relative': 10})
    assert errors['depth']['bias'] == pytest.approx(0.2) and errors['slipping_fraction']['bias'] == pytest.approx(-10)


def test_dots_that_are_not_seen_have_a_column_of_their_own():
    reported = region(5e-3, [0, 1, 2])
    found = summed((Instant(region=reported), Instant(region=region(5e-3, [0, 2, 2, 1]))))['dot_states']
    assert found['counts'] == [[1, 0, 0, 0], [0, 0, 0, 1], [0, 1, 1, 0]] and found['reported'][-1] == 'not seen'
    assert found['f1']['slipping'] == pytest.approx(2 / 3)


def test_slip_is_judged_where_something_touches_and_its_velocity_at_the_contact():
    turning = Instant(region=region(5e-3, [], (0.01, 0)), slip=slip(2, 1.0, 0.0, turn=1.0))
    still = Instant(region=region(5e-3, [], (0.01, 0)), slip=slip(2, 1.0, 0.0))
    free = Instant([], region(0, []), slip(1, 0.5, 1.0))
    still.slip.angular[:] = np.nan  # as of a disc
    found = summed((still, turning), (free, Instant([], region(0, []), slip(0, np.nan, 0.0))))
    assert found['slip_states']['counts'] == [[0, 0, 0], [0, 0, 0], [0, 0, 1]] and found['slip_states']['macro_f1'] == 1
    assert found['errors']['slip_velocity']['median'] == pytest.approx(10)


def test_weak_wrenches_have_no_relative_error_and_unknown_ones_are_counted():
    frames = [(Instant(wrench=factor * 1.2 * WRENCH), Instant(wrench=factor * WRENCH)) for factor in (1.0, 0.5, 0.01)]
    errors = summed(*frames, (Instant(wrench=np.full(6, np.nan)), Instant(wrench=WRENCH)))['errors']
    assert errors['force']['count'] == 3 and errors['force_relative']['count'] == 2
    assert errors['force']['not_reported'] == errors['moment_relative']['not_reported'] == 1
    assert errors['force_relative']['worst'] == pytest.approx(20)


def test_of_a_wrench_the_axes_that_are_reported_are_judged():
    reported = np.where(np.arange(6) == 4, np.nan, 1.2 * WRENCH)
    errors = summed((Instant(wrench=reported), Instant(wrench=WRENCH)))['errors']
    assert errors['moment']['median'] == pytest.approx(2) and errors['moment_relative']['median'] == pytest.approx(20)


def test_a_region_that_was_missed_overlaps_by_nothing():
    found = summed((Instant(region=region(0, [])), Instant(region=region(5e-3, []))))
    assert found['errors']['region_overlap']['median'] == 0 and found['errors']['region_centroid']['not_reported'] == 1


def test_what_was_never_said_is_not_judged():
    found = summed((Instant([contact(0, 0)]), Instant(wrench=WRENCH)), (Instant(), Instant()))
    assert found['errors'] == {} and found['dot_states'] is found['slip_states'] is None and found['frames']['judged'] == 0

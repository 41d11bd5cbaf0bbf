# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled finger at its border: any array that NumPy can make is processed or refused by name, an exception changes nothing, a copy
continues by itself."""
import copy
from threading import Thread

import numpy as np
import played
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type

from tactile_perception._core.finger import centroid_covariance
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.finger.model import FingerModel
from tactile_perception.finger.parameters import FingerSettings, PsdFinger

PERIOD = played.PERIOD
VOLTS = played.scene('taps')[0][:700]


def results(finger, volts=VOLTS, stamp_s=1.0):
    """All numbers that come of voltages."""
    rows = []
    for k in range(0, len(volts), 7):
        for one in finger.estimate(volts[k:k + 7], stamp_s + k * PERIOD, PERIOD).estimates:
            touch = one.touch
            known = [] if touch is None else [touch.id, *touch.position, *touch.normal, *touch.position_covariance.ravel()]
            rows.append([k + one.at] + known)
    return rows


@pytest.mark.parametrize('kind', [np.float32, np.float64])
@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
def test_any_array_is_processed_or_refused_by_name_however_it_lies_in_memory(kind, check):
    made = PsdFinger(FingerModel(), FingerSettings(reference_seconds=0.01))
    results(made, VOLTS[:100])
    arrays = {'volts': VOLTS[300:340].astype(kind)}

    def call(volts=arrays['volts']):
        return np.array([(one.at, one.touch is not None) for one in copy.copy(made).estimate(volts, 1.2, PERIOD).estimates])
    check(call, arrays, 'volts', *((BadFrame,) if check is not check_memory else ()))


@pytest.mark.parametrize('period', [1e-9, 1e-7, 1.0, 1e9])
def test_any_sample_period_is_processed(finger, period):
    for size in (1, 3, 200):
        finger.estimate(VOLTS[:size], 1.0, period)


@pytest.mark.parametrize('call', [
    lambda f: f.estimate(VOLTS[:, :3], 1.0, PERIOD), lambda f: f.estimate(VOLTS, 1.0, -1.0), lambda f: f.estimate(VOLTS, np.nan, PERIOD),
    lambda f: f.estimate(VOLTS[:2], 1.0, np.nan), lambda f: f.estimate(VOLTS[:0], 1.0, PERIOD)])
def test_an_exception_leaves_the_finger_unchanged(model, call):
    finger, plain = PsdFinger(model), PsdFinger(model)
    assert results(finger) == results(plain)
    with pytest.raises(BadFrame):
        call(finger)
    assert results(finger, stamp_s=2.0) == results(plain, stamp_s=2.0)


@pytest.mark.parametrize('copied', [copy.copy, copy.deepcopy])
def test_a_copy_of_the_finger_is_independent(finger, copied):
    results(finger, VOLTS[:500])
    other = copied(finger)
    expected = results(other, VOLTS[500:], 1.5)
    other.set_reference()
    assert finger.ready and not other.ready and results(finger, VOLTS[500:], 1.5) == expected


def test_threads_may_share_a_finger(finger):
    threads = [Thread(target=results, args=(finger,)) for _ in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert finger.estimate(VOLTS[:300], 9.0, PERIOD).estimates


@pytest.mark.parametrize('name', ['radius', 'saturation', 'reference_seconds', 'fastest_drift', 'threshold'])
@pytest.mark.parametrize('value', [0.0, -1.0, np.inf])
def test_settings_that_are_not_positive_are_refused(name, value):
    with pytest.raises(BadArgument, match=name):
        FingerSettings(**{name: value})


def test_arrays_of_the_smaller_functions_are_checked():
    for spot, noise in ((np.zeros(3), np.eye(4)), (np.zeros(2), np.eye(3)), (None, np.eye(4))):
        with pytest.raises(ValueError, match='^(spot|noise): '):
            centroid_covariance(spot, 1.0, noise)

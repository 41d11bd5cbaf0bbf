# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels of a PSD finger; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

VOLTS = np.random.default_rng(3).uniform(0, 2, (40, 4))
TABLE = np.random.default_rng(4).uniform(0.5, 1.5, (5, 5, 13))
INSIDE, SATURATED, FOUR = np.arange(40) % 3 > 0, np.arange(40) % 7 == 0, np.full(4, 0.1)
PLACES = np.random.default_rng(5).uniform(-1, 1, (40, 2))
HELD = _core.held_begin(_core.held_before(), FOUR, np.zeros(4))
TOUCH = {'sums': VOLTS, 'in_contact': INSIDE, 'saturated': SATURATED, 'table': TABLE, 'noise': np.eye(4)}


def call_finger_samples(volts=VOLTS, offset=FOUR, table=TABLE):
    """The arrays for samples of a PSD finger."""
    return _core.finger_samples(volts, offset, table, lit=0.1, least=0.2, saturation=1.9, level=5)[:4]


def call_finger_touch(**arrays):
    """The arrays of the touch of some samples."""
    found = _core.finger_touch(**TOUCH | {'loads': np.ones((2, 8)), 'state': HELD} | arrays, shot=0.0, cross_volts=0.1, offset_volts=0.1,
                               radius=0.016, stuck=False)
    return [] if found is None else [found[0], found[1], found[4]]


def call_held_follow(**arrays):
    """State and sums after samples of a contact."""
    return _core.held_follow(**{'state': HELD} | TOUCH | arrays, cross_volts=0.1, period=1e-3)[:2]


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'finger_samples': (call_finger_samples, {'volts': VOLTS, 'offset': FOUR, 'table': TABLE}),
    'finger_touch': (call_finger_touch, TOUCH | {'loads': np.ones((2, 8)), 'state': HELD}),
    'held_before': (lambda: [_core.held_before()], {}),
    'held_begin': (lambda state=HELD, offset=FOUR, calibrated=FOUR: [_core.held_begin(state, offset, calibrated)],
                   {'state': HELD, 'offset': FOUR, 'calibrated': FOUR}),
    'held_interrupt': (lambda state=HELD: [_core.held_interrupt(state)], {'state': HELD}),
    'held_follow': (call_held_follow, {'state': HELD} | TOUCH),
    'count_repeats': (lambda volts=VOLTS, last=FOUR, same=FOUR: _core.count_repeats(volts, last, same, saturation=1.9),
                      {'volts': VOLTS, 'last': FOUR, 'same': FOUR}),
    'place_values': (lambda places=PLACES, table=TABLE: [_core.place_values(places, table)], {'places': PLACES, 'table': TABLE}),
    'place_covariance': (lambda place=FOUR[:2], noise=np.eye(4): [_core.place_covariance(place, 1.5, noise, 0.01)],
                         {'place': FOUR[:2], 'noise': np.eye(4)}),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)


@pytest.mark.parametrize('wrong', [{'shot': -1.0}, {'cross_volts': np.nan}, {'offset_volts': -1.0}, {'radius': np.inf}])
def test_numbers_of_finger_touch_are_checked(wrong):
    numbers = {'shot': 0.0, 'cross_volts': 0.1, 'offset_volts': 0.1, 'radius': 0.016, 'stuck': False} | wrong
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        _core.finger_touch(**TOUCH, loads=np.ones((2, 8)), state=HELD, **numbers)

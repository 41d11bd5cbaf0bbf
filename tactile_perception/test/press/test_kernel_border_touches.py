# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels that follow touches, and tell their region and depths; see test_border.py."""
import copy

import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

FOLLOWED = {'values': np.full((2, 4), 1e-3) * [[5], [1]], 'spreads': np.tile(1e-8 * np.eye(4), (2, 1, 1))}
SETTINGS = {'acceleration': 2.0, 'gate': 20.0, 'speed': 0.3, 'most_missed': 3}
MARKERS = np.random.default_rng(0).uniform(-0.02, 0.02, (9, 2))
VIEWED = {'tips': np.array([[0.0, 0.001, -0.003, 0.003, 0.008]]), 'rest': MARKERS, 'shift': MARKERS / 20,
          'eye': np.tile([0.0, 0.0, -0.06], (9, 1))}
SKIN = {'size': (0.06, 0.05), 'rim_radius': 0.0, 'height': 0.0, 'plane': 0.0}
SHEET = {'bending': np.eye(9) + 0.1, 'strain': np.eye(9), 'slope': MARKERS, 'shift': MARKERS / 30}


def tracker(**changes):
    return _core.ContactTracker(**SETTINGS | changes)


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'ContactTracker.update': (lambda **arrays: [track.state for track in tracker().update(**FOLLOWED | arrays, elapsed=0.03)], FOLLOWED),
    'sheet_depths': (lambda **arrays: [_core.sheet_depths(**SHEET | arrays)], SHEET),
    'touch_region': (lambda **arrays: _core.touch_region(**VIEWED | arrays, **SKIN), VIEWED),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)


@pytest.mark.parametrize('wrong', [{'acceleration': np.inf}, {'gate': 0.0}, {'speed': np.nan}, {'most_missed': -1}])
def test_numbers_of_a_tracker_are_checked(wrong):
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        tracker(**wrong)


@pytest.mark.parametrize('wrong', [{'elapsed': -1.0}, {'elapsed': np.nan}, {'values': np.full((2, 4), np.nan)}])
def test_a_tracker_that_refuses_a_frame_is_as_it_was_and_a_copy_is_one_of_its_own(wrong):
    one = tracker()
    first = [track.id for track in one.update(**FOLLOWED, elapsed=0.0)]
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        one.update(**FOLLOWED | {'elapsed': 0.03} | wrong)
    other = copy.deepcopy(one)
    other.reset()
    assert [track.id for track in one.update(**FOLLOWED, elapsed=0.03)] == first == [1, 2]
    assert [track.id for track in other.update(**FOLLOWED, elapsed=0.03)] == [3, 4]


@pytest.mark.parametrize('wrong', [{'size': (np.nan, 0.05)}, {'size': (0.0, 0.05)}, {'rim_radius': -1.0}, {'height': np.nan},
                                   {'plane': np.inf}])
def test_numbers_of_touch_region_are_checked(wrong):
    with pytest.raises(ValueError, match=f'^{next(iter(wrong))}: '):
        _core.touch_region(**VIEWED, **SKIN | wrong)

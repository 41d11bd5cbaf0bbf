# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels that compare markers with their untouched positions; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

ID, SIGMA = np.arange(42), np.full(42, 0.02)
UV = 20.0 * np.argwhere(np.ones((6, 7)))[:, ::-1]
MOVED = {'id': ID, 'places': UV, 'motions': UV / 99, 'known': UV * 98 / 99}
SEEN_MARKERS = {'id': ID, 'uv': UV, 'duv': UV / 99, 'area': 50 + UV[:, 0]}
UNTOUCHED = {'known_uv': UV, 'known_area': 50 + UV[:, 1], 'frames': np.full(42, 3.0)}
APPARENT = {'places': np.tile(np.column_stack([UV, SIGMA]), (2, 1)), 'eye': np.ones((42, 3)), 'sigma': SIGMA,
            'known_area': 50 + UV[:, 1]}


def call_follow_markers(**arrays):
    """Untouched markers that follow."""
    return _core.follow_markers(**SEEN_MARKERS | UNTOUCHED | arrays, moved=0.3, still=0.3, most_frames=9)


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'rest_moved': (lambda **arrays: [_core.rest_moved(**MOVED | arrays, limit=0.1)], MOVED),
    'follow_markers': (call_follow_markers, SEEN_MARKERS | UNTOUCHED),
    'marker_field': (lambda **arrays: _core.marker_field(**SEEN_MARKERS | APPARENT | arrays, metres_per_px=1e-4),
                     SEEN_MARKERS | APPARENT),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)


@pytest.mark.parametrize('shift, moved', [(0.0, False), (0.09, False), (0.11, True)])
def test_rest_moved_is_told_by_one_dot(shift, moved):
    known, motions = UV * 98 / 99, UV / 99 + np.where(ID[:, None] == 9, [0.0, shift], 0.0)
    motions[3] = np.nan  # not seen
    assert _core.rest_moved(ID, UV, motions, known, limit=0.1) == moved

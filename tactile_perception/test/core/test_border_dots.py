# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels that index and link dots and compare them with their reference; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

GRID = {'rows': 6, 'columns': 7}
RC, ID = np.argwhere(np.ones((6, 7))), np.arange(42)
UV, SIGMA = 20.0 * RC[:, ::-1], np.full(42, 0.02)
PRINTED = {'places': UV, 'rc': RC + 3, 'member': ID % 3 > 0, 'before': UV + 1, 'before_id': ID}
MOVED = {'id': ID, 'places': UV, 'motions': UV / 99, 'known': UV * 98 / 99}
KNOWN = {'known_id': ID, 'known_places': UV - 1}
SEEN = {'id': ID, 'places': UV, 'sigma': SIGMA, 'before_id': ID, 'before': UV}

SEEN_MARKERS = {'id': ID, 'uv': UV, 'duv': UV / 99, 'area': 50 + UV[:, 0]}
UNTOUCHED = {'known_uv': UV, 'known_area': 50 + UV[:, 1], 'frames': np.full(42, 3.0)}
APPARENT = {'places': np.tile(np.column_stack([UV, SIGMA]), (2, 1)), 'eye': np.ones((42, 3)), 'sigma': SIGMA,
            'known_area': 50 + UV[:, 1]}

SMALL = np.arange(600, dtype=np.uint8).reshape(20, 30)
REGIONS = {'image': np.repeat(np.repeat(SMALL, 2, 0), 2, 1), 'small': SMALL, 'labels': np.ones((20, 30), np.uint16),
           'box': np.array([[3, 4, 10, 12]], np.int32), 'centre': np.array([[8.0, 9.0]]), 'label': np.ones(1, np.uint16)}


def call_anchor_lattice(**arrays):
    """Indices of most dots of a grid."""
    return _core.anchor_lattice(**PRINTED | arrays, **GRID, pitch=20.0, width=200, height=200)


def call_follow_drift(**arrays):
    """A reference that follows."""
    return _core.follow_drift(**{'id': ID, 'places': UV, 'counts': ID} | KNOWN | arrays, frames=5, slow=0.1)


def call_follow_markers(**arrays):
    """Untouched markers that follow."""
    return _core.follow_markers(**SEEN_MARKERS | UNTOUCHED | arrays, moved=0.3, still=0.3, most_frames=9)


#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'anchor_lattice': (call_anchor_lattice, PRINTED),
    'reject_outliers': (lambda id=ID, places=UV: [_core.reject_outliers(id, places, **GRID)], {'id': ID, 'places': UV}),
    'reference_places': (lambda **arrays: [_core.reference_places(**{'id': ID} | KNOWN | arrays)], {'id': ID} | KNOWN),
    'follow_drift': (call_follow_drift, {'id': ID, 'places': UV, 'counts': ID} | KNOWN),
    'rest_moved': (lambda **arrays: [_core.rest_moved(**MOVED | arrays, limit=0.1)], MOVED),
    'deviation_from_drift': (lambda places=UV, motions=UV / 99, sigma=SIGMA: _core.deviation_from_drift(places, motions, sigma),
                             {'places': UV, 'motions': UV / 99, 'sigma': SIGMA}),
    'assign_least': (lambda cost=UV[:2] / 9: [_core.assign_least(cost)], {'cost': UV[:2] / 9}),
    'link_places': (lambda places=UV, dots=UV + 3: [_core.link_places(places, dots, gate=9.0)], {'places': UV, 'dots': UV + 3}),
    'nearest_others': (lambda places=UV: _core.nearest_others(places, count=4), {'places': UV}),
    'find_blob_regions': (lambda mask=SMALL // 128: _core.find_blob_regions(mask, speck=2, least=0.2, most=5.0), {'mask': SMALL // 128}),
    'fit_blobs': (lambda **arrays: [_core.fit_blobs(**REGIONS | arrays, step=2)[0]], REGIONS),
    'follow_markers': (call_follow_markers, SEEN_MARKERS | UNTOUCHED),
    'marker_field': (lambda **arrays: _core.marker_field(**SEEN_MARKERS | APPARENT | arrays, metres_per_px=1e-4),
                     SEEN_MARKERS | APPARENT),
    'have_stayed': (lambda **arrays: [_core.have_stayed(**SEEN | arrays)], SEEN),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)

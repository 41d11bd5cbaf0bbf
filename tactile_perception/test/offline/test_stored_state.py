# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A stage's state comes back as it was, and nothing else does."""
import os
import pickle

import numpy as np
import pytest
from tactile_perception.dots.dots import DotTracks
from tactile_perception.errors import BadRecording
from tactile_perception.offline.stored_state import load_state, store_state


def test_numbers_arrays_and_own_objects_come_back():
    values = np.array([1.0, np.nan, 3e-308])
    stored = store_state({'tracks': DotTracks(0, 0, np.arange(3), np.zeros((3, 2)), values, values, np.zeros((3, 2))), 'both': values})
    state = load_state(stored)
    assert state['tracks'].area.tobytes() == values.tobytes() and state['tracks'].area is state['both']


class _Evil:
    def __reduce__(self):
        return os.system, ('true',)


def test_what_is_no_part_of_a_state_is_not_made():
    with pytest.raises(BadRecording, match='posix.system is no part of it'):
        load_state(pickle.dumps(_Evil()))
    for data in (b'', b'nothing', store_state(np.zeros(3))[:-4]):
        with pytest.raises(BadRecording, match='cannot be read'):
            load_state(data)

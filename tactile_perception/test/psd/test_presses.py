# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import played
import pytest

from tactile_perception.errors import BadCalibration
from tactile_perception.psd.geometry import TOTAL
from tactile_perception.psd.presses import Recording, find_presses


def test_presses_are_cut_into_stretches_with_their_loads():
    recording = played.recording('grid')
    presses = find_presses([recording], 4.9)
    stretches = presses.stretches
    assert len(presses.onsets.level) == 25 and presses.left_out == []
    assert stretches.count.max() <= 50 and len(stretches.count) > 100
    assert np.sqrt(presses.noise[TOTAL, TOTAL]) == pytest.approx(0.023, rel=0.1)
    assert np.unique(stretches.normal.round(6), axis=0).shape == (25, 3)
    assert (presses.onsets.level < 0.3 * presses.onsets.brightest).all()


def test_a_contact_that_moves_is_many_places():
    stretches = find_presses([played.recording('slide')], 4.9).stretches
    assert len(np.unique(stretches.normal.round(4), axis=0)) > 100


def test_a_stage_that_tells_of_a_press_only_while_it_stands_does_no_harm():
    recording = played.recording('grid')
    edges = np.flatnonzero(np.diff(recording.touching.astype(np.int8)))
    late = np.zeros_like(recording.touching)
    for begin, end in zip(edges[::2], edges[1::2]):
        late[begin + 80:end - 80] = True
    known = Recording(recording.volts, played.PERIOD, late, recording.normal, recording.force, recording.depth)
    exact, found = (find_presses([r], 4.9).stretches.sums[:, TOTAL].max() for r in (recording, known))
    assert found == pytest.approx(exact, rel=0.01)


def test_what_cannot_be_used_is_told():
    recording = played.recording('grid')
    touching = np.ones(len(recording.volts), bool)
    with pytest.raises(BadCalibration, match='untouched'):
        find_presses([Recording(recording.volts, played.PERIOD, touching, recording.normal, recording.force, recording.depth)], 4.9)
    unknown = np.full_like(recording.normal, np.nan)
    with pytest.raises(BadCalibration, match='no usable press'):
        find_presses([Recording(recording.volts, played.PERIOD, recording.touching, unknown, recording.force, recording.depth)], 4.9)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import played
import pytest

from tactile_perception.errors import BadCalibration
from tactile_perception.psd.presses import Recording, find_presses
from tactile_perception.psd.signals import TOTAL


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


def test_what_cannot_be_used_is_told():
    recording = played.recording('grid')
    touching = np.ones(len(recording.volts), bool)
    with pytest.raises(BadCalibration, match='untouched'):
        find_presses([Recording(recording.volts, played.PERIOD, touching, recording.normal, recording.force, recording.depth)], 4.9)
    unknown = np.full_like(recording.normal, np.nan)
    with pytest.raises(BadCalibration, match='no usable press'):
        find_presses([Recording(recording.volts, played.PERIOD, recording.touching, unknown, recording.force, recording.depth)], 4.9)

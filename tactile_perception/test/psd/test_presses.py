# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import played
import pytest

from tactile_perception.errors import BadCalibration
from tactile_perception.psd.geometry import TOTAL
from tactile_perception.psd.presses import Recording, _offset, _rest_before, _runs, find_presses


def test_presses_are_cut_into_stretches_with_their_loads():
    recording = played.recording('grid')
    presses = find_presses([recording], 4.9)
    segments = presses.segments
    assert len(presses.onsets.level) == 25 and presses.left_out == []
    assert segments.count.max() <= 50 and len(segments.count) > 100
    assert np.sqrt(presses.noise[TOTAL, TOTAL]) == pytest.approx(0.023, rel=0.1)
    assert presses.room == pytest.approx(recording.volts[:100].mean(0), abs=0.01)
    assert np.unique(segments.normal.round(6), axis=0).shape == (25, 3)
    assert (presses.onsets.level < 0.3 * presses.onsets.brightest).all()


def test_a_sliding_contact_is_cut_into_many_positions():
    segments = find_presses([played.recording('slide')], 4.9).segments
    assert len(np.unique(segments.normal.round(4), axis=0)) > 100


def test_late_labels_of_contact_do_no_harm():
    recording = played.recording('grid')
    edges = np.flatnonzero(np.diff(recording.touching.astype(np.int8)))
    late = np.zeros_like(recording.touching)
    for begin, end in zip(edges[::2], edges[1::2]):
        late[begin + 80:end - 80] = True
    known = Recording(recording.volts, played.PERIOD, late, recording.normal, recording.force, recording.depth)
    exact, found = (find_presses([r], 4.9).segments.sums[:, TOTAL].max() for r in (recording, known))
    assert found == pytest.approx(exact, rel=0.01)


def test_unusable_recordings_are_refused():
    recording = played.recording('grid')
    touching = np.ones(len(recording.volts), bool)
    with pytest.raises(BadCalibration, match='untouched'):
        find_presses([Recording(recording.volts, played.PERIOD, touching, recording.normal, recording.force, recording.depth)], 4.9)
    unknown = np.full_like(recording.normal, np.nan)
    with pytest.raises(BadCalibration, match='no usable press'):
        find_presses([Recording(recording.volts, played.PERIOD, recording.touching, unknown, recording.force, recording.depth)], 4.9)


@pytest.mark.parametrize(('room', 'better'), [(lambda t: 0.05 * t, 0.6), (lambda t: 0.3 * (t > 5.0), 1.01)])
def test_the_offset_follows_drift_by_the_presses_around_and_a_step_at_once(room, better):
    """Net light of presses by a known offset: an even drift is told better than by the samples before each press alone."""
    recording = played.recording('grid')
    volts = recording.volts + 0.25 * room(played.PERIOD * np.arange(len(recording.volts)))[:, None]
    spoilt = Recording(volts, played.PERIOD, recording.touching, recording.normal, recording.force, recording.depth)
    runs = _runs(recording.touching)
    untouched = [_rest_before(spoilt, begin) for begin, _ in runs]
    true = 0.25 * room(played.PERIOD * np.array([begin for begin, _ in runs])) + recording.volts[:400].mean()
    own = [rest.mean() - offset for rest, offset in zip(untouched, true)]
    found = [_offset(spoilt, runs, untouched, k).mean() - offset for k, offset in enumerate(true)]
    assert np.std(found) < better * np.std(own)

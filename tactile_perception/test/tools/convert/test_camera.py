# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording folder gives images, stamps and truth as they are written; what is missing is named."""
import json

import numpy as np
import pytest
from touchpad_bags import change_truth
from tactile_driver.simulation.truth import GROSS, INCIPIENT, NO_SLIP
from tactile_perception.errors import BadRecording
from tactile_perception.tools.convert.camera import Recording


def test_the_truth_of_a_free_and_of_touched_frames(recording_folder):
    recording = Recording(recording_folder)
    free, touched, slipping = (recording.truth(k) for k in range(3))
    assert free.contacts == [] and free.outlines == [] and free.area == 0 and np.isnan(free.slipping_fraction)
    assert free.slip_state == NO_SLIP and np.isnan(free.velocity).all()
    assert touched.dot_id.tolist() == list(range(12)) and touched.dot_state.tolist() == [1] * 4 + [0] * 8
    assert len(touched.outlines) == 1 and len(touched.holes) == 1 and touched.outlines[0].shape == (4, 3)
    contact, = touched.contacts
    assert contact.depth == pytest.approx(1e-3) and contact.force == pytest.approx(2.0)
    np.testing.assert_allclose(contact.position, [1e-3, 2e-3, 12e-3], rtol=1e-6)
    np.testing.assert_allclose(touched.wrench, [0.1, 0, -2, 0, 0, 0], atol=1e-7)
    assert touched.slip_state == NO_SLIP and slipping.slip_state == GROSS and slipping.slipping_fraction == 1


def test_incipient_slip_is_some_but_not_all(recording_folder):
    change_truth(recording_folder, lambda truth: truth['dot_state'].__setitem__((1, 0), 2))
    frame = Recording(recording_folder).truth(1)
    assert frame.slip_state == INCIPIENT and frame.slipping_fraction == pytest.approx(0.25)


@pytest.mark.parametrize('changes', [{'static': True}, {'sensor': 'areal_single'}])
def test_a_static_recording_and_a_round_tip_on_a_sheet_tell_places_by_the_tools_tip(recording_folder, changes):
    sensor = json.loads((recording_folder / 'sensor.json').read_text())
    (recording_folder / 'sensor.json').write_text(json.dumps(sensor | changes))
    np.testing.assert_allclose(Recording(recording_folder).truth(1).contacts[0].position, [3e-3, 0, 11e-3], rtol=1e-6)


@pytest.mark.parametrize('name', ['sensor.json', 'truth.npz', 'frames/001.png'])
def test_a_missing_file_is_named(recording_folder, name):
    (recording_folder / name).unlink()
    with pytest.raises(BadRecording, match='no |2 images in frames/ but 3 stamps'):
        Recording(recording_folder)


@pytest.mark.parametrize('name', ['sensor.json', 'truth.npz'])
def test_a_broken_file_is_named(recording_folder, name):
    (recording_folder / name).write_bytes(b'\x00broken')
    with pytest.raises(BadRecording, match=name):
        Recording(recording_folder)


def test_a_file_that_is_no_image_is_named(recording_folder):
    (recording_folder / 'frames/001.png').write_bytes(b'x')
    with pytest.raises(BadRecording, match='001.png'):
        Recording(recording_folder).image(1)


def test_a_tip_between_the_dots_touches_too(dual_folder):
    change_truth(dual_folder, lambda truth: truth.update(dot_contact=np.zeros_like(truth['dot_contact']), dot_state=0 * truth['dot_state']))
    frame = Recording(dual_folder).truth(1)
    contact, = frame.contacts
    assert contact.depth == pytest.approx(1e-3) and contact.force == pytest.approx(2.0)
    np.testing.assert_allclose(contact.position, [3e-3, 0, 11e-3], rtol=1e-6)
    assert np.isnan(frame.slipping_fraction) and np.isnan(frame.velocity).all() and frame.slip_state == NO_SLIP


def test_numbers_of_dots_begin_at_the_first_row_and_column(recording_folder):
    change_truth(recording_folder, lambda truth: truth.update(dot_rc=truth['dot_rc'] + 1))
    assert Recording(recording_folder).truth(0).dot_id.tolist() == list(range(12))

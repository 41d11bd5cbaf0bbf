# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of cameras and arrays become bags."""
import json
import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from touchpad_bags import change_truth

from tactile_driver.nodes.messages.images import image_to_array
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.truth import GROSS, INCIPIENT, NO_SLIP
from tactile_perception.core.errors import BadRecording
from tactile_perception.core.parameter_files import read_parameters, write_parameters
from tactile_perception.press.parameters import MARKER_PARAMETERS, MARKER_SENSOR_PARAMETERS, marker_sensor
from tactile_perception.tools import calibrate, process_bag
from tactile_perception.tools.convert import command as convert_recording, command as module
from tactile_perception.tools.convert.camera import Recording, sensor_parameters
from tactile_perception.tools.convert.taxel import TaxelRecording
from tactile_perception.touchpad.parameters import TOUCHPAD_PARAMETERS

FIRST = {'description', '/tf_static'}
TOPICS = {'camera_info', 'image_raw', 'ground_truth/contacts', 'ground_truth/contact_region', 'ground_truth/slip', 'ground_truth/wrench'}


@pytest.fixture
def converted(recording_folder, tmp_path):
    return convert(recording_folder, tmp_path / 'bag')


def convert(folder, bag):
    """Topic -> [(stamp, message)] of the folder as a bag."""
    assert module.main([str(folder), str(bag), '--namespace', 'pad']) == 0
    found = {}
    with BagReader(bag) as reader:
        for message in reader.messages():
            decoded = decode(message.data, message.type_name)
            found.setdefault(message.topic.removeprefix('/pad/'), []).append((message.stamp_ns, decoded))
    return found


def test_every_frame_is_there_with_its_truth(converted):
    assert set(converted) == TOPICS | FIRST
    for name in TOPICS:
        messages, frame = converted[name], 'pad' if name.startswith('ground_truth') else 'pad_camera_optical'
        assert {m.header.frame_id for _, m in messages} == {frame}
        assert [stamp for stamp, _ in messages] == [1_000_000_000, 1_100_000_000, 1_200_000_000], 'no stamp of zero'
        assert all(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == stamp for stamp, m in messages)


def test_it_begins_with_the_description_and_the_frames_of_the_sensor(recording_folder, converted, dual_folder, tmp_path):
    about = yaml.safe_load(converted['description'][0][1].data)
    assert about == {'sensor_type': 'touchpad', 'frame_id': 'pad', 'source': 'file', 'path': str(recording_folder)}
    (stamp, message), = converted['/tf_static']
    assert stamp == 1_000_000_000 and [t.child_frame_id for t in message.transforms] == ['pad_camera_optical']
    camera = Recording(recording_folder).views[0].camera  # the camera's own origin in the sensor frame
    at, away = message.transforms[0].transform.translation, np.array(camera['t_cam_from_sensor'])
    assert (at.x, at.y, at.z) == pytest.approx(tuple(-np.array(camera['R_cam_from_sensor']).T @ away))
    both = convert(dual_folder, tmp_path / 'two')['/tf_static'][0][1].transforms
    assert [t.child_frame_id for t in both] == ['pad_left_camera_optical', 'pad_right_camera_optical']


def test_the_parameters_are_the_sensors(recording_folder, converted, tmp_path):
    values = read_parameters(tmp_path / 'bag.yaml', 'touchpad_contact_node', TOUCHPAD_PARAMETERS)
    assert (values['rows'], values['columns']) == (3, 4) and values['cap.height'] == 0.013
    assert values['membrane.shear_stiffness'] == 90.0 and values['camera.translation'] == [0.0, 0.0, 0.04]


@pytest.mark.parametrize(('touched', 'frames'), [([0, 0, 1], 2), ([1, 0, 1], 1)])
def test_frames_before_the_first_contact_make_the_reference(recording_folder, touched, frames):
    change_truth(recording_folder, lambda truth: truth.update(contact_area=np.array(touched, float)))
    assert Recording(recording_folder).parameters()['reference.frames'] == frames


def test_what_cannot_be_converted_is_said_in_one_line(recording_folder, tmp_path, capsys):
    (tmp_path / 'there').mkdir()
    for arguments in ([str(tmp_path / 'none'), str(tmp_path / 'a')], [str(recording_folder), str(tmp_path / 'there')]):
        assert module.main(arguments) == 1
        lines = capsys.readouterr().err.strip().splitlines()
        assert len(lines) == 1 and lines[0].startswith('convert_recording: ')


def test_two_cameras_become_two_topics_under_their_own_stamps(dual_folder, tmp_path):
    found = convert(dual_folder, tmp_path / 'bag')
    views = {f'{side}/{name}' for side in ('left', 'right') for name in ('camera_info', 'image_raw')}
    assert set(found) == FIRST | views | {name for name in TOPICS if name.startswith('ground_truth')}
    for name, late in (('left/image_raw', 0), ('right/image_raw', 4_000_000), ('right/camera_info', 4_000_000), ('ground_truth/wrench', 0)):
        assert [stamp for stamp, _ in found[name]] == [1_000_000_000 + late, 1_100_000_000 + late, 1_200_000_000 + late]
    assert [int(image_to_array(m)[0, 0, 0]) for _, m in found['right/image_raw']] == [110, 120, 130]
    assert found['right/camera_info'][0][1].k[0] == 1.0 and found['left/camera_info'][0][1].k[0] == 70.0
    values = read_parameters(tmp_path / 'bag.yaml', 'press_contact_node', MARKER_SENSOR_PARAMETERS)
    sensor = marker_sensor(values)
    assert (sensor.type, sensor.rows, sensor.columns, sensor.size) == ('areal_dual', 3, 4, (0.133, 0.091))
    assert sensor.pitch == pytest.approx((9.4e-3, 8.2e-3))
    dots = read_parameters(tmp_path / 'bag.yaml', 'press_contact_node', MARKER_PARAMETERS)
    assert (dots['polarity'], dots['detection'], dots['sensor_type']) == ('bright', 'blobs', 'areal_dual')


@pytest.mark.skipif('TACTILE_RECORDINGS' not in os.environ, reason='TACTILE_RECORDINGS is not set: no recordings')
@pytest.mark.parametrize(('name', 'sensor_type', 'rows', 'columns', 'pitch', 'size'), [
    ('as_test', 'areal_single', 9, 13, (4.5e-3, 4.5e-3), (0.060, 0.045)),
    ('ad_test', 'areal_dual', 11, 14, (9.4e-3, 8.2e-3), (0.133, 0.091)),
    ('ac_test', 'air_cushion', 17, 17, (15.4e-3, 15.4e-3), (0, 0))])
def test_recorded_sheets_and_domes(name, sensor_type, rows, columns, pitch, size, tmp_path):
    folder = Path(os.environ['TACTILE_RECORDINGS']) / 'simulated' / name
    sensor = json.loads((folder / 'sensor.json').read_text())
    write_parameters(tmp_path / 'a.yaml', sensor_parameters(sensor))
    found = marker_sensor(read_parameters(tmp_path / 'a.yaml', 'press_contact_node', MARKER_SENSOR_PARAMETERS))
    assert (found.type, found.rows, found.columns, found.size) == (sensor_type, rows, columns, size)
    assert found.pitch == pytest.approx(pitch, rel=0.01) and found.is_sheet == (sensor_type != 'air_cushion')
    recording, truth = Recording(folder), np.load(folder / 'truth.npz')
    for k, depth in enumerate(truth['depth']):
        frame = recording.truth(k)
        assert len(frame.contacts) == (depth > 0)
        np.testing.assert_allclose(frame.wrench, np.r_[truth['force'][k], truth['moment_sensor'][k]])
        for contact in frame.contacts:
            np.testing.assert_allclose(contact.position, truth['obj_p'][k], rtol=1e-6)
            assert contact.depth == pytest.approx(depth, rel=1e-6) and contact.force == pytest.approx(-truth['force'][k, 2], rel=1e-6)


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
    with pytest.raises(BadRecording, match='is missing|2 images in frames/ but 3 stamps'):
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


RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'))
needs_simulated = pytest.mark.skipif(not (RECORDINGS / 'simulated/tac_cal_flat').is_dir(),
                                     reason='TACTILE_RECORDINGS names no folder with simulated/tac_cal_flat')
needs_weights = pytest.mark.skipif(not (RECORDINGS / 'dsa_slip/weights').is_dir(),
                                   reason='TACTILE_RECORDINGS names no folder with dsa_slip/weights')


def weights_file(path, letters='ABCDEFGH'):
    """Imprints of a sensor whose values are 100 a newton, spread over four taxels."""
    arrays = {}
    for k, letter in enumerate('ABCDEFGH'):
        if letter in letters:
            values = np.zeros((20, 6, 5), np.uint16)
            values[5:, 2:4, 1:3] = 100 * (0.2 + 0.1 * k) * 9.81 / 4
            arrays |= {letter + '1': values, letter + '1_t_ms': 10**12 + 30 * np.arange(20)}
    np.savez(path, **arrays)


def test_imprints_of_weights_calibrate_the_sensor(tmp_path, capsys):
    weights_file(tmp_path / 'w.npz')
    assert convert_recording.main([str(tmp_path / 'w.npz'), str(tmp_path / 'bag')]) == 0
    params = tmp_path / 'bag.yaml'
    values = yaml.safe_load(params.read_text())['/**']['ros__parameters']
    assert (values['rows'], values['columns'], values['sensor_type']) == (6, 5, 'taxel_array')
    assert calibrate.main([str(tmp_path / 'bag'), '--params', str(params), '--output', str(tmp_path / 'c.yaml')]) == 0
    reported = capsys.readouterr().out
    assert '8 loads, 1.96 to 8.83 N' in reported
    assert float(reported.split('held-out loads: error ')[1].split('%')[0]) < 3
    assert process_bag.main([str(tmp_path / 'bag'), str(tmp_path / 'out'), '--params', str(params), '--calibration',
                             str(tmp_path / 'c.yaml')]) == 0


def test_one_weight_is_refused(tmp_path, capsys):
    weights_file(tmp_path / 'w.npz', 'A')
    convert_recording.main([str(tmp_path / 'w.npz'), str(tmp_path / 'bag')])
    assert calibrate.main([str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'c.yaml')]) == 1
    assert 'at least 3' in capsys.readouterr().err and not (tmp_path / 'c.yaml').exists()


def test_broken_recordings(tmp_path):
    (tmp_path / 'meta.json').write_text(json.dumps({'sensor': 'taxel_array'}))
    (tmp_path / 'x.npz').write_text('no')
    for path in (tmp_path, tmp_path / 'x.npz', tmp_path / 'none.npz'):
        with pytest.raises(BadRecording):
            TaxelRecording(path)


@needs_simulated
def test_a_simulated_recording_as_a_bag():
    recording = TaxelRecording(RECORDINGS / 'simulated/tac_static_ring')
    topics = [topic for _, topic, _ in recording.messages('pad')]
    assert topics.count('image_raw') == len(recording) == 80 and topics.count('ground_truth/wrench') == 80
    assert recording.parameters()['pad.friction'] == pytest.approx(0.6)


@needs_weights
@pytest.mark.parametrize('name, most', [('operating', 5.0), ('room', 8.0)])
@pytest.mark.full
def test_real_weights_held_out(name, most, tmp_path, capsys):
    convert_recording.main([str(RECORDINGS / f'dsa_slip/weights/{name}.npz'), str(tmp_path / 'bag')])
    assert calibrate.main([str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'c.yaml')]) == 0
    assert float(capsys.readouterr().out.split('held-out loads: error ')[1].split('%')[0]) < most

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording folder becomes a bag with ground truth under its stamps, and the parameters of its sensor."""
import pytest
from tactile_perception.nodes.conversions import image_to_array
from tactile_perception.nodes.serialization import MessageCodec
from tactile_perception.offline import convert_recording as module
from tactile_perception.offline.bags import BagReader
from tactile_perception.offline.recording import Recording
from tactile_perception.pipeline.parameter_file import read_parameters
from tactile_perception.pipeline.parameters import DOT_PARAMETERS

pytestmark = pytest.mark.ros
TOPICS = {'camera_info', 'image_raw', 'ground_truth/contacts', 'ground_truth/contact_region', 'ground_truth/slip', 'ground_truth/wrench'}


@pytest.fixture
def converted(recording_folder, tmp_path):
    assert module.main([str(recording_folder), str(tmp_path / 'bag'), '--namespace', 'pad']) == 0
    codec, found = MessageCodec(), {}
    with BagReader(tmp_path / 'bag') as reader:
        for message in reader.messages():
            decoded = codec.decode(message.data, message.type_name)
            found.setdefault(message.topic.removeprefix('/pad/'), []).append((message.stamp_ns, decoded))
    return found


def test_every_frame_is_there_with_its_truth(converted):
    assert set(converted) == TOPICS
    for messages in converted.values():
        assert [stamp for stamp, _ in messages] == [1_000_000_000, 1_100_000_000, 1_200_000_000], 'no stamp of zero'
        assert all(m.header.frame_id == 'pad' and m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == stamp for stamp, m in messages)


def test_images_and_numbers_are_as_recorded(recording_folder, converted):
    recording = Recording(recording_folder)
    for k, (_, message) in enumerate(converted['image_raw']):
        assert (image_to_array(message) == recording.image(k)).all()
    assert converted['camera_info'][0][1].k.reshape(3, 3)[0, 0] == 70.0
    contacts = [m.contacts for _, m in converted['ground_truth/contacts']]
    assert [len(c) for c in contacts] == [0, 1, 1] and contacts[1][0].id == contacts[2][0].id
    assert contacts[1][0].depth == pytest.approx(1e-3) and converted['ground_truth/wrench'][1][1].wrench.force.z == pytest.approx(-2)
    assert len(converted['ground_truth/contact_region'][1][1].holes) == 1
    assert [m.state for _, m in converted['ground_truth/slip']] == [0, 0, 2]


def test_the_parameters_are_the_sensors(recording_folder, converted, tmp_path):
    values = read_parameters(tmp_path / 'bag.yaml', 'dot_tracker_node', DOT_PARAMETERS)
    assert (values['rows'], values['columns']) == (3, 4) and values['cap.height'] == 0.013
    assert values['membrane.shear_stiffness'] == 90.0 and values['camera.translation'] == [0.0, 0.0, 0.04]


def test_what_cannot_be_converted_is_said_in_one_line(recording_folder, tmp_path, capsys):
    (tmp_path / 'there').mkdir()
    for arguments in ([str(tmp_path / 'none'), str(tmp_path / 'a')], [str(recording_folder), str(tmp_path / 'there')]):
        assert module.main(arguments) == 1
        lines = capsys.readouterr().err.strip().splitlines()
        assert len(lines) == 1 and lines[0].startswith('convert_recording: ')

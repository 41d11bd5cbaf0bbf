# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import yaml
from ament_index_python.packages import get_package_share_directory
from tactile_bringup.simulate.bags import main
from tactile_driver.nodes.messages.ground_truth import TRUTH
from tactile_driver.recordings.reader import BagReader
from tactile_perception.tools.process_bag import main as process_bag


def topics(path):
    """Topic -> number of its messages."""
    found = {}
    with BagReader(path) as bag:
        for raw in bag.messages():
            found[raw.topic] = found.get(raw.topic, 0) + 1
    return found


def test_each_kind_of_sensor_with_its_truth(tmp_path, capsys):
    assert main(['camera', 'areal_single_press', str(tmp_path / 'sheet'), '--rate', '1']) == 0
    frames = int(capsys.readouterr().out.split(':')[1].split()[0])
    found = topics(tmp_path / 'sheet')
    assert {found[f'/areal_single/{name}'] for name in ('image_raw', 'camera_info', *(f'ground_truth/{t}' for t in TRUTH))} == {frames}
    assert main(['taxel_array', 'rest', str(tmp_path / 'pad'), '--rate', '5', '--seed', '3']) == 0
    assert topics(tmp_path / 'pad')['/taxel_array/image_raw'] == 15
    assert main(['psd_finger', 'rest', str(tmp_path / 'finger'), '--rate', '100']) == 0
    assert topics(tmp_path / 'finger')['/psd_finger/voltages'] == 1000


def test_descriptions_and_frames_go_with_a_recording_as_ros2_bag_play_will_offer_them(tmp_path):
    bag, params = tmp_path / 'pad', get_package_share_directory('tactile_bringup') + '/params/taxel_array_sim.yaml'
    assert main(['taxel_array', 'rest', str(bag), '--rate', '5']) == 0
    assert process_bag([str(bag), str(tmp_path / 'estimates'), '--params', params]) == 0
    latched, passing = ('reliable', 'transient_local'), ('reliable', 'volatile')
    for path, raw in ((bag, '/taxel_array/image_raw'), (tmp_path / 'estimates', '/taxel_array/contacts')):
        about = yaml.safe_load((path / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
        topics_of = [topic['topic_metadata'] for topic in about['topics_with_message_count']]
        found = {topic['name']: [(qos['reliability'], qos['durability']) for qos in topic['offered_qos_profiles']] for topic in topics_of}
        assert about['ros_distro'] == 'jazzy'
        assert found['/taxel_array/description'] == found['/tf_static'] == [latched] and found[raw] == [passing]
        assert topics(path)['/taxel_array/description'] == topics(path)['/tf_static'] == 1


def test_what_is_wrong_is_said_in_one_line(tmp_path, capsys):
    assert main(['taxel_array', 'nowhere', str(tmp_path / 'bag')]) == 1
    said = capsys.readouterr().err
    assert said.startswith("simulate: simulation: scene 'nowhere' is unknown; choose one of ") and said.count('\n') == 1
    assert not (tmp_path / 'bag').exists()
    (tmp_path / 'bag').mkdir()
    assert main(['camera', 'areal_single_rest', str(tmp_path / 'bag')]) == 1 and 'exists' in capsys.readouterr().err

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What `ros2 bag play` of Jazzy reads of a bag, read back by the libraries rosbags and mcap."""
import pytest
import yaml
from rosbags.interfaces import Qos, QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from string_messages import STORE, TYPE, encoded
from tactile_perception.bags.rosbag2_writer import Rosbag2Writer, recorded_qos, usual_qos

OTHER = usual_qos('/other')._replace(reliability=QosReliability.BEST_EFFORT)
OFFERED = {'/pad/image_raw': [], '/pad/description': [], '/pad/camera_info': [], '/tf_static': [], '/other/image': [OTHER, OTHER]}
#: topic -> (reliability, durability) of its publishers
WANTED = {'/pad/image_raw': [('reliable', 'volatile')], '/pad/description': [('reliable', 'transient_local')],
          '/pad/camera_info': [('reliable', 'transient_local')], '/tf_static': [('reliable', 'transient_local')],
          '/other/image': [('best_effort', 'volatile')] * 2}
FOR_EVER = {'sec': 9223372036, 'nsec': 854775807}


@pytest.fixture
def bag(tmp_path):
    writer = Rosbag2Writer(tmp_path / 'bag', STORE)
    writer.open()
    for k, (topic, offered) in enumerate(OFFERED.items()):
        writer.write(writer.add_topic(topic, TYPE, offered), k + 1, encoded(topic))
    writer.close()
    return tmp_path / 'bag'


def policies(profiles):
    return [(profile['reliability'], profile['durability']) for profile in profiles]


def test_metadata_is_of_jazzy_and_tells_the_qos_as_a_list_of_names(bag):
    metadata = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert (metadata['version'], metadata['ros_distro'], metadata['storage_identifier']) == (9, 'jazzy', 'mcap')
    told = {topic['topic_metadata']['name']: topic['topic_metadata']['offered_qos_profiles']
            for topic in metadata['topics_with_message_count']}
    assert {topic: policies(profiles) for topic, profiles in told.items()} == WANTED
    assert told['/tf_static'] == [{'history': 'keep_last', 'depth': 10, 'reliability': 'reliable', 'durability': 'transient_local',
                                   'deadline': FOR_EVER, 'lifespan': FOR_EVER, 'liveliness': 'automatic',
                                   'liveliness_lease_duration': FOR_EVER, 'avoid_ros_namespace_conventions': False}]
    assert sorted(file.name for file in bag.iterdir()) == ['bag.mcap', 'metadata.yaml']


def test_the_library_rosbags_reads_the_same(bag):
    with Reader(bag) as reader:
        found = {connection.topic: connection.ext.offered_qos_profiles for connection in reader.connections}
        assert [connection.topic for connection, _, _ in reader.messages()] == list(OFFERED)
    assert found['/pad/description'] == [usual_qos('/pad/description')] and found['/other/image'] == [OTHER, OTHER]
    assert isinstance(found['/tf_static'][0], Qos) and found['/tf_static'][0].durability == QosDurability.TRANSIENT_LOCAL


def test_a_publishers_qos_is_told_as_it_is():
    qos = pytest.importorskip('rclpy.qos', reason='ROS is not sourced')
    ever = qos.Duration(nanoseconds=2**63 - 1)
    profile = qos.QoSProfile(depth=10, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL, liveliness=qos.LivelinessPolicy.AUTOMATIC,
                             deadline=ever, lifespan=ever, liveliness_lease_duration=ever)
    assert recorded_qos(profile) == usual_qos('/tf_static')
    profile.deadline = qos.Duration(seconds=2, nanoseconds=5)
    assert recorded_qos(profile).deadline == (2, 5)


def test_the_library_mcap_finds_it_in_the_channels_and_in_the_file_itself(bag):
    reading = pytest.importorskip('mcap.reader', reason='the library mcap is not installed')
    with (bag / 'bag.mcap').open('rb') as file:
        reader = reading.make_reader(file)
        channels = {channel.topic: yaml.safe_load(channel.metadata['offered_qos_profiles'])
                    for channel in reader.get_summary().channels.values()}
        inside = [record.metadata['serialized_metadata'] for record in reader.iter_metadata() if record.name == 'rosbag2']
        assert [channel.topic for _, channel, _ in reader.iter_messages()] == list(OFFERED)
    assert {topic: policies(profiles) for topic, profiles in channels.items()} == WANTED
    assert yaml.safe_load(inside[0])['ros_distro'] == 'jazzy'

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as they are written, and messages as bytes."""

import math

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import Point32, Polygon
from rclpy.qos import DurabilityPolicy, Duration, LivelinessPolicy, QoSProfile
from sensor_msgs.msg import Image
from small_bags import TYPE, encoded
from std_msgs.msg import String
from tactile_driver.errors import BadArgument, BadFrame
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode, type_hash, type_name_of, unusable
from tactile_driver.recordings.writer import BagWriter, recorded_qos, usual_qos, write_messages
from tactile_msgs.msg import ContactRegion, DotTracks, Slip

OTHER = usual_qos('/other') | {'reliability': 'best_effort'}
OFFERED = {'/pad/image_raw': [], '/pad/description': [], '/pad/camera_info': [], '/tf_static': [], '/other/image': [OTHER, OTHER]}
#: topic -> (reliability, durability) of its publishers
WANTED = {'/pad/image_raw': [('reliable', 'volatile')], '/pad/description': [('reliable', 'transient_local')],
          '/pad/camera_info': [('reliable', 'transient_local')], '/tf_static': [('reliable', 'transient_local')],
          '/other/image': [('best_effort', 'volatile')] * 2}
FOR_EVER = {'sec': 9223372036, 'nsec': 854775807}


def test_messages_come_back_in_the_order_of_their_stamps(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        for stamp, topic in ((30, '/b'), (10, '/a'), (20, '/b')):
            writer.write(topic, TYPE, stamp, encoded(f'{topic} {stamp}'))
    with BagReader(tmp_path / 'bag') as reader:
        assert reader.topics == {'/a': TYPE, '/b': TYPE}
        assert [(m.topic, m.stamp_ns, m.data) for m in reader.messages()] == [
            (t, s, encoded(f'{t} {s}')) for t, s in (('/a', 10), ('/b', 20), ('/b', 30))
        ]
        assert [m.stamp_ns for m in reader.messages({'/b'})] == [20, 30]


def test_nothing_recorded_is_overwritten(tmp_path):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(BadArgument, match='exists'):
        BagWriter(tmp_path / 'bag')
    with pytest.raises(BadArgument, match='exists'):
        write_messages(tmp_path, 'pad', [])


def test_where_no_bag_can_be_made_one_line_says_so(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(BadArgument, match='file/bag: cannot be written'), BagWriter(tmp_path / 'file' / 'bag'):
        pass


def test_messages_are_written_under_the_namespace(tmp_path):
    write_messages(tmp_path / 'bag', '/left/pad/', iter([(5, 'said', String(data='a')), (7, '/heard/too', String(data='b'))]))
    with BagReader(tmp_path / 'bag') as reader:
        found = [(raw.stamp_ns, raw.topic, decode(raw.data, raw.type_name).data) for raw in reader.messages()]
    assert found == [(5, '/left/pad/said', 'a'), (7, '/heard/too', 'b')]


@pytest.fixture
def bag(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        for k, (topic, offered) in enumerate(OFFERED.items()):
            writer.add_topic(topic, TYPE, offered)
            writer.write(topic, TYPE, k + 1, encoded(topic))
    return tmp_path / 'bag'


def policies(profiles):
    return [(profile['reliability'], profile['durability']) for profile in profiles]


def test_metadata_is_of_jazzy_and_tells_the_qos_as_a_list_of_names(bag):
    metadata = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert (metadata['version'], metadata['ros_distro'], metadata['storage_identifier']) == (9, 'jazzy', 'mcap')
    about = {topic['topic_metadata']['name']: topic['topic_metadata'] for topic in metadata['topics_with_message_count']}
    reported = {topic: one['offered_qos_profiles'] for topic, one in about.items()}
    assert {topic: policies(profiles) for topic, profiles in reported.items()} == WANTED
    assert reported['/tf_static'] == [{'history': 'keep_last', 'depth': 10, 'reliability': 'reliable', 'durability': 'transient_local',
                                   'deadline': FOR_EVER, 'lifespan': FOR_EVER, 'liveliness': 'automatic',
                                   'liveliness_lease_duration': FOR_EVER, 'avoid_ros_namespace_conventions': False}]
    assert about['/tf_static']['type_description_hash'] == type_hash(TYPE)
    assert sorted(file.name for file in bag.iterdir()) == ['bag_0.mcap', 'metadata.yaml']


def test_a_publishers_qos_is_reported_as_it_is():
    ever = Duration(nanoseconds=2**63 - 1)
    profile = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL, liveliness=LivelinessPolicy.AUTOMATIC, deadline=ever,
                         lifespan=ever, liveliness_lease_duration=ever)
    assert recorded_qos(profile) == usual_qos('/tf_static')
    profile.deadline = Duration(seconds=2, nanoseconds=5)
    assert recorded_qos(profile)['deadline'] == {'sec': 2, 'nsec': 5}


def test_the_library_mcap_finds_it_in_the_channels_and_in_the_file_itself(bag):
    reading = pytest.importorskip('mcap.reader', reason='the library mcap is not installed')
    with (bag / 'bag_0.mcap').open('rb') as file:
        reader = reading.make_reader(file)
        channels = {channel.topic: yaml.safe_load(channel.metadata['offered_qos_profiles'])
                    for channel in reader.get_summary().channels.values()}
        schemas = {schema.name: schema.data.decode() for schema in reader.get_summary().schemas.values()}
        inside = [record.metadata['serialized_metadata'] for record in reader.iter_metadata() if record.name == 'rosbag2']
        assert [channel.topic for _, channel, _ in reader.iter_messages()] == list(OFFERED)
    assert {topic: policies(profiles) for topic, profiles in channels.items()} == WANTED
    assert 'string data' in schemas[TYPE] and yaml.safe_load(inside[-1])['ros_distro'] == 'jazzy'


def region():
    message = ContactRegion(dot_id=[1, 2, 3], dot_state=[0, 1, 2], area=1.5e-5, orientation=math.nan,
                            outlines=[Polygon(points=[Point32(x=1.0, y=2.0, z=3.0)])])
    message.header.frame_id, message.header.stamp.sec = 'pad', 7
    return message


def test_the_same_message_is_the_same_bytes():
    """The middleware leaves padding as it finds it in memory; what goes into a bag must not depend on that."""
    first, kept = encode(region())[1], []
    for k in range(200):
        kept.append(np.random.default_rng(k).bytes(k * 7))
        assert encode(region())[1] == first
    slip = encode(Slip(state=1, x=[1.0], y=[2.0], vx=[0.0], vy=[0.0]))[1]
    assert all(encode(Slip(state=1, x=[1.0], y=[2.0], vx=[0.0], vy=[0.0]))[1] == slip for _ in range(200))


def test_bytes_of_another_type_are_refused():
    with pytest.raises(BadFrame, match='3 bytes are no sensor_msgs/msg/Image'):
        decode(b'abc', 'sensor_msgs/msg/Image')
    with pytest.raises(BadFrame, match='no_such'):
        decode(b'abc', 'no_such_msgs/msg/Thing')


def test_names_and_hashes():
    assert type_name_of(Image) == 'sensor_msgs/msg/Image' and type_name_of(DotTracks) == 'tactile_msgs/msg/DotTracks'
    # as rosbag2 of Jazzy records it
    assert type_hash('std_msgs/msg/String') == 'RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18'
    assert type_hash('no_msgs/msg/None') == type_hash('std_msgs/msg/None') == ''


def test_types_of_a_recording_are_usable_or_refused_by_name():
    known = type_hash('tactile_msgs/msg/Slip')
    assert unusable('tactile_msgs/msg/Slip', known) == unusable('tactile_msgs/msg/Slip', '') == ''
    assert 'defined otherwise in the recording' in unusable('tactile_msgs/msg/Slip', 'RIHS01_' + 64 * '1')
    assert unusable('no_msgs/msg/None', '') == 'type no_msgs/msg/None is not installed'

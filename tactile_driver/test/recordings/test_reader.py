# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording of cameras: written, and read, whole and damaged."""
import math
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import Point32, Polygon
from rclpy.qos import DurabilityPolicy, Duration, LivelinessPolicy, QoSProfile
from rosbag2_py import ConverterOptions, SequentialWriter, StorageOptions, TopicMetadata
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from tactile_driver.errors import BadArgument, BadFrame, BadRecording
from tactile_driver.recordings.reader import BagReader, LeftOut, descriptions, recorded_description, truth_topics, with_truth
from tactile_driver.recordings.serialization import decode, encode, type_hash, type_name_of, unusable
from tactile_driver.recordings.writer import BagWriter, recorded_qos, usual_qos, write_messages
from tactile_msgs.msg import ContactRegion, DotTracks, Slip

TYPE = 'std_msgs/msg/String'


def encoded(text):
    return encode(String(data=text))[1]


def write_bag(path, count, size=300_000, first=0, preset=''):
    """Messages 'first', 'first + 1' ... followed by size incompressible bytes of text, on /a at 10 ns, 20 ns ..., as a bag; its file."""
    writer = SequentialWriter()
    writer.open(StorageOptions(uri=str(path), storage_id='mcap', storage_preset_profile=preset), ConverterOptions())
    writer.create_topic(TopicMetadata(id=0, name='/a', type=TYPE, serialization_format='cdr', type_description_hash=type_hash(TYPE)))
    for k in range(first, first + count):
        writer.write('/a', message(k, size), 10 * (k + 1))
    del writer  # closes it
    return next(file for file in path.iterdir() if file.name != 'metadata.yaml')


def message(number, size=300_000):
    filling = ''.join(chr(33 + (number * 7919 + j * j * 31 + j // 97) % 90) for j in range(1000)) * (size // 1000)
    return encoded(f'{number} {filling}')


def numbers(messages):
    """Of the messages, as they were written."""
    return [int(bytes(data[8:40]).split(b' ')[0].strip(b'\0')) for data in messages]


@pytest.mark.parametrize('preset', ['', 'zstd_fast', 'fastwrite'])
def test_reads_what_was_written_chunks_compressed_or_not(tmp_path, preset):
    write_bag(tmp_path / 'bag', 3, 1000, preset=preset)
    with BagReader(tmp_path / 'bag') as reader:
        assert reader.topics == {'/a': TYPE} and reader.count({'/a'}) == 3 and reader.hashes == {'/a': type_hash(TYPE)}
        for _ in range(2):
            assert [(m.topic, m.type_name, m.stamp_ns, m.data) for m in reader.messages()] == [
                ('/a', TYPE, 10 * (k + 1), message(k, 1000)) for k in range(3)]
        assert list(reader.messages({'/b'})) == [] and reader.left_out.total == 0


def test_two_passes_at_a_time_do_not_disturb_each_other(tmp_path):
    write_bag(tmp_path / 'bag', 4, size=1000)
    with BagReader(tmp_path / 'bag') as reader:
        one, other = reader.messages(), reader.messages({'/a'})
        assert [next(one).stamp_ns, next(other).stamp_ns, next(one).stamp_ns, next(other).stamp_ns] == [10, 10, 20, 20]


def test_a_bag_of_several_files_is_read_one_after_the_other_and_one_file_alone(tmp_path):
    bag = tmp_path / 'bag'
    bag.mkdir()
    for part in range(11):
        write_bag(tmp_path / f'part_{part}', 2, size=1000, first=2 * part).rename(bag / f'bag_{part}.mcap')
    with BagReader(bag) as reader:
        assert numbers(m.data for m in reader.messages()) == list(range(22)) and reader.count({'/a'}) == 22
        assert reader.left_out.lines() == ['1 of bag: there is no metadata.yaml: the recording was cut off']
    with BagReader(bag / 'bag_1.mcap') as reader:
        assert numbers(m.data for m in reader.messages({'/a'})) == [2, 3] and not reader.left_out.total


@pytest.mark.parametrize('kept', [0.5, 0.95])
@pytest.mark.parametrize('preset', ['', 'fastwrite', 'zstd_fast'])
def test_an_unfinished_file_is_read_up_to_what_is_whole(tmp_path, preset, kept):
    file = write_bag(tmp_path / 'bag', 20, preset=preset)
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    data = file.read_bytes()
    file.write_bytes(data[:int(kept * len(data))])
    with BagReader(tmp_path / 'bag') as reader:
        found = numbers(m.data for m in reader.messages())
        assert reader.count({'/a'}) == len(found) and found == list(range(len(found)))
    assert 0 < len(found) <= 20
    if preset == 'fastwrite':
        assert 0 <= 20 * kept - len(found) < 1, 'at most one message is cut'


def test_a_file_that_cannot_be_read_costs_no_other(tmp_path):
    write_bag(tmp_path / 'bag', 3, size=1000)
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    (tmp_path / 'bag' / 'bag_1.mcap').write_bytes(b'')
    with BagReader(tmp_path / 'bag') as reader:
        assert numbers(m.data for m in reader.messages()) == [0, 1, 2]
        assert any('bag_1.mcap' in line and 'cannot be read' in line for line in reader.left_out.lines())


def test_a_file_that_is_cut_off_after_it_was_closed_is_read_and_what_is_missing_reported(tmp_path):
    file = write_bag(tmp_path / 'bag', 20)
    file.write_bytes(file.read_bytes()[:3_000_000])
    with BagReader(tmp_path / 'bag') as reader:
        found = numbers(m.data for m in reader.messages())
        assert 4 <= len(found) < 10 and found == list(range(len(found)))
        line, = reader.left_out.lines()
    assert line.startswith(f'{20 - len(found)} of bag') and 'mcap recover' in line and 'ros2 bag reindex' in line


def test_damage_amid_a_file_ends_it_and_is_reported(tmp_path):
    file = write_bag(tmp_path / 'bag', 20, preset='zstd_fast')
    data = bytearray(file.read_bytes())
    at = data.index(b'\x28\xb5\x2f\xfd', len(data) // 2)  # where a compressed chunk begins
    data[at:at + 4] = b'none'
    file.write_bytes(data)
    with BagReader(tmp_path / 'bag') as reader:
        found = numbers(m.data for m in reader.messages())
        assert 0 < len(found) < 20 and found == list(range(len(found)))
        assert reader.left_out.total == 20 - len(found)


def test_a_file_of_the_metadata_that_is_gone_is_reported(tmp_path):
    write_bag(tmp_path / 'bag', 3, size=1000)
    metadata = tmp_path / 'bag' / 'metadata.yaml'
    page = yaml.safe_load(metadata.read_text())
    about = page['rosbag2_bagfile_information']
    about['relative_file_paths'].append('bag_1.mcap')
    about['topics_with_message_count'][0]['message_count'] = about['message_count'] = 5
    metadata.write_text(yaml.safe_dump(page))
    with BagReader(tmp_path / 'bag') as reader:
        assert len(list(reader.messages())) == 3 and reader.left_out.total >= 1


def cut(file):
    file.write_bytes(file.read_bytes()[:20])


@pytest.mark.parametrize('damage', [cut, lambda file: file.write_text('no bag' * 100), lambda file: file.unlink(),
                                    lambda file: (file.parent / 'metadata.yaml').write_text('a: [')])
def test_what_is_worse_ends_with_one_line_that_says_what_to_do(tmp_path, damage):
    damage(write_bag(tmp_path / 'bag', 3, size=1000))
    with pytest.raises(BadRecording,
                       match='cannot be read: .*ros2 bag reindex .*bag.*mcap recover') as reported, BagReader(tmp_path / 'bag'):
        pass
    assert '\n' not in str(reported.value)


def test_a_missing_and_an_empty_bag_are_named(tmp_path):
    with pytest.raises(BadRecording, match='no such file'):
        BagReader(tmp_path / 'none')
    (tmp_path / 'bag').mkdir()
    with pytest.raises(BadRecording, match='cannot be read'), BagReader(tmp_path / 'bag'):
        pass


def topics_of(path, **messages):
    """Topics of a bag with these, as read; their counts; topic and type of its messages."""
    write_messages(path, 'pad', [(10**9 + k, name.replace('__', '/'), message) for k, (name, message) in enumerate(messages.items())])
    with BagReader(path) as reader:
        names = dict(reader.topics)
        assert {topic: reader.count({topic}) for topic in names} == dict.fromkeys(names, 1)
        assert [raw.topic for raw in reader.messages({'/pad/image_raw'})] == ['/pad/image_raw'] * ('/pad/image_raw' in names)
        assert sorted((raw.topic, raw.type_name) for raw in reader.messages()) == sorted(names.items())
    return names


def test_compressed_images_have_the_name_of_raw_ones_where_there_are_none(tmp_path):
    compressed, image = 'sensor_msgs/msg/CompressedImage', 'sensor_msgs/msg/Image'
    assert topics_of(tmp_path / 'without', image_raw__compressed=CompressedImage(), description=String()) == {
        '/pad/image_raw': compressed, '/pad/description': 'std_msgs/msg/String'}
    assert topics_of(tmp_path / 'with', image_raw__compressed=CompressedImage(), image_raw=Image()) == {
        '/pad/image_raw': image, '/pad/image_raw/compressed': compressed}
    assert topics_of(tmp_path / 'other', words__compressed=String()) == {'/pad/words/compressed': 'std_msgs/msg/String'}


def test_reasons_that_differ_in_their_numbers_count_as_one():
    found = LeftOut()
    found.add('image_raw', 'image is 64 x 48 px', 1_500_000_000)
    found.add('image_raw', 'image is 32 x 24 px', 2_500_000_000)
    found.add('bag.mcap', 'the file is cut off at byte 7', count=3)
    assert found.total == 5
    assert found.lines() == ['3 of bag.mcap: the file is cut off at byte 7',
                             '2 of image_raw: image is 64 x 48 px (first at 1.500 s)']


def test_so_many_reasons_are_reported_apart_and_no_more():
    found = LeftOut()
    for k in range(26):
        for other in 'abcd':
            found.add('topic', f'reason {chr(97 + k)}{other}')
    assert found.total == 104 and len(found.lines()) == 51 and found.lines()[0] == '54 of elsewhere: other reasons'


SIMULATED = {'sensor_type': 'touchpad', 'source': 'sim', 'scene': 'rest'}
REPLAYED = {'sensor_type': 'touchpad', 'source': 'bag', 'path': 'first', 'recorded': SIMULATED}


@pytest.mark.parametrize('raw_topic', ['/pad/image_raw', '/pad/left/image_raw'])
@pytest.mark.parametrize(('text', 'expected'), [(yaml.safe_dump(SIMULATED), SIMULATED), (yaml.safe_dump(REPLAYED), SIMULATED),
                                                ('a text', {}), ('[1, 2', {}), ('', {})])
def test_the_description_of_the_sensor_itself_beside_the_raw_topic_or_above_it(tmp_path, raw_topic, text, expected):
    said = (('/pad/description', text), ('/other/description', 'sensor_type: psd_finger'))
    write_messages(tmp_path / 'bag', '', ((10**9, topic, String(data=words)) for topic, words in said))
    with BagReader(tmp_path / 'bag') as reader:
        assert recorded_description(reader, raw_topic) == expected


def test_descriptions_of_all_sensors_in_order_without_what_is_none(tmp_path):
    said = [('thumb/description', 'source: sim'), ('index/description', 'source: device\nserial: A1'), ('thumb/description', '[cut'),
            ('thumb/description', 'only words'), ('thumb/note', 'source: bag')]
    write_messages(tmp_path / 'bag', 'hand', ((k + 1, topic, String(data=text)) for k, (topic, text) in enumerate(said)))
    assert list(descriptions(tmp_path / 'bag')) == [{'source': 'sim'}, {'source': 'device', 'serial': 'A1'}]
    with pytest.raises(BadRecording):
        list(descriptions(tmp_path / 'nowhere'))


CONTACTS = 'tactile_msgs/msg/Contacts'


@pytest.mark.parametrize('raw', ['/left/pad/image_raw', '/left/pad/right/image_raw'])
def test_it_is_beside_the_raw_data_and_of_the_right_type(raw):
    types = {raw: 'sensor_msgs/msg/Image', '/left/pad/ground_truth/contacts': CONTACTS, '/left/pad/ground_truth/slip': CONTACTS,
             '/other/ground_truth/contacts': CONTACTS}
    assert truth_topics(types, raw) == {'/left/pad/ground_truth/contacts': 'contacts'}


def test_each_raw_message_comes_with_the_truth_recorded_after_it():
    order = 't0 i1 t1 u1 i2 i3 t3 other i4'.split()
    names = {'t': '/pad/ground_truth/contacts', 'u': '/pad/ground_truth/wrench', 'i': '/pad/image_raw', 'o': '/pad/other'}
    messages = [SimpleNamespace(topic=names[word[0]], data=word) for word in order]
    found = with_truth(messages, '/pad/image_raw', {names['t']: 'contacts', names['u']: 'wrench'})
    reported = [(raw.data, truth and [(name, data) for name, data in truth.messages]) for raw, truth in found]
    first = [('contacts', 't0'), ('contacts', 't1'), ('wrench', 'u1')]
    assert reported == [('i1', first), ('i2', None), ('i3', [('contacts', 't3')]), ('i4', None)]


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
    with pytest.raises(BadFrame, match='3 bytes cannot be decoded as sensor_msgs/msg/Image'):
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

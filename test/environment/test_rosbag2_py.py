# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""rosbag2_py is the same where there is no ROS 2: each name of rosbag2's own module of Jazzy is there, and works or says what it needs.

Where rosbag2 is installed, these tests run on its own module.
"""
import enum

import pytest
import rosbag2_py
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rosbag2_py import (
    CompressionMode,
    CompressionOptions,
    ConverterOptions,
    ReadOrder,
    ReadOrderSortBy,
    SequentialCompressionReader,
    SequentialCompressionWriter,
    SequentialReader,
    SequentialWriter,
    StorageFilter,
    StorageOptions,
    TopicMetadata,
)
from rosidl_runtime_py.utilities import get_message
from std_msgs.msg import String

#: What rosbag2_py of rosbag2 0.26 offers: classes with their methods and attributes, functions.
READER = {'open', 'open_uri', 'set_read_order', 'read_next', 'has_next', 'get_metadata', 'get_all_topics_and_types',
          'get_all_message_definitions', 'set_filter', 'reset_filter', 'seek'}
WRITER = {'open', 'write', 'create_topic', 'remove_topic', 'take_snapshot', 'split_bagfile'}
TOPIC = {'id', 'name', 'type', 'serialization_format', 'offered_qos_profiles', 'type_description_hash', 'equals'}
FACE = {
    'BagMetadata': {'version', 'bag_size', 'storage_identifier', 'relative_file_paths', 'files', 'duration', 'starting_time',
                    'message_count', 'topics_with_message_count', 'compression_format', 'compression_mode', 'custom_data', 'ros_distro'},
    'CompressionMode': {'NONE', 'FILE', 'MESSAGE'},
    'CompressionOptions': {'compression_format', 'compression_mode', 'compression_queue_size', 'compression_threads'},
    'ConverterOptions': {'input_serialization_format', 'output_serialization_format'},
    'FileInformation': {'path', 'starting_time', 'duration', 'message_count'},
    'Info': {'read_metadata', 'read_metadata_and_output_service_verbose'},
    'LocalMessageDefinitionSource': {'get_full_text'},
    'MessageDefinition': {'topic_type', 'encoding', 'encoded_message_definition', 'type_hash'},
    'MetadataIo': {'deserialize_metadata', 'metadata_file_exists', 'read_metadata', 'serialize_metadata', 'write_metadata'},
    'ReadOrder': {'sort_by', 'reverse'},
    'ReadOrderSortBy': {'ReceivedTimestamp', 'PublishedTimestamp', 'File'},
    'Reindexer': {'reindex'},
    'SequentialCompressionReader': READER,
    'SequentialCompressionWriter': WRITER,
    'SequentialReader': READER,
    'SequentialWriter': WRITER | {'close'},
    'StorageFilter': {'topics', 'services_events', 'regex', 'exclude_topics', 'exclude_service_events', 'regex_to_exclude'},
    'StorageOptions': {'uri', 'storage_id', 'max_bagfile_size', 'max_bagfile_duration', 'max_cache_size', 'storage_preset_profile',
                       'storage_config_uri', 'snapshot_mode', 'start_time_ns', 'end_time_ns', 'custom_data'},
    'TopicInformation': {'topic_metadata', 'message_count'},
    'TopicMetadata': TOPIC,
    **dict.fromkeys(('compression_mode_from_string', 'compression_mode_to_string', 'convert_rclcpp_qos_to_rclpy_qos',
                     'get_default_storage_id', 'get_registered_compressors', 'get_registered_readers', 'get_registered_serializers',
                     'get_registered_writers', 'to_rclcpp_qos_vector'), set())}
#: What needs rosbag2's own nodes: without them it is refused by name.
NODES = {'Player', 'PlayOptions', 'Recorder', 'RecordOptions', 'ServiceRequestsSource', 'bag_rewrite'}
STORAGES = ('mcap', 'sqlite3')
is_stand_in = hasattr(rosbag2_py, 'NeedsRosbag2')
needs_stand_in = pytest.mark.skipif(not is_stand_in, reason="rosbag2's own module is installed")


def test_the_names_are_those_of_rosbag2():
    assert set(rosbag2_py.__all__) == {*FACE, *NODES}


@pytest.mark.parametrize('name', FACE)
def test_each_class_has_all_methods_and_attributes(name):
    found = getattr(rosbag2_py, name)
    if isinstance(found, type) and issubclass(found, enum.Enum):
        assert FACE[name] == set(found.__members__)
    else:
        assert callable(found)
        assert FACE[name] <= {*dir(found), *getattr(found, '__dataclass_fields__', ())}


@needs_stand_in
@pytest.mark.parametrize('name', sorted(NODES))
def test_what_needs_rosbag2_is_refused_by_name(name):
    with pytest.raises(RuntimeError, match=f"rosbag2_py.{name} needs ROS 2's own rosbag2"):
        getattr(rosbag2_py, name)()


@pytest.mark.skipif(is_stand_in, reason="rosbag2's own module is not installed")
@pytest.mark.parametrize('name', FACE)
def test_the_list_of_names_is_complete(name):
    found = getattr(rosbag2_py, name)
    public = set(found.__members__ if hasattr(found, '__members__') else dir(found) if isinstance(found, type) else ())
    assert FACE[name] == {word for word in public if not word.startswith('_')}


def writing(**options):
    """Opens a new bag with options, in a folder that is given."""
    return lambda folder: SequentialWriter().open(StorageOptions(str(folder / 'bag'), **options), ConverterOptions())


#: What is there, but refused: words of the error -> a call that raises it.
REFUSED = {
    **{f'StorageOptions.{next(iter(options))}': writing(**options) for options in (
        {'max_bagfile_size': 10}, {'max_bagfile_duration': 10}, {'snapshot_mode': True}, {'storage_config_uri': 'x.yaml'},
        {'start_time_ns': 5}, {'end_time_ns': 5})},
    'reading in reverse order': lambda folder: opened(write(folder / 'bag', 'mcap')).set_read_order(
        ReadOrder(ReadOrderSortBy.ReceivedTimestamp, True)),
    'the compression lz4': lambda _folder: SequentialCompressionWriter(CompressionOptions('lz4', CompressionMode.FILE, 0, 1)),
    'Info.read_metadata_and_output_service_verbose': lambda folder: rosbag2_py.Info().read_metadata_and_output_service_verbose(
        str(folder), 'mcap'),
    'the definition of the type std_srvs/srv/Trigger': lambda _folder: rosbag2_py.LocalMessageDefinitionSource().get_full_text(
        'std_srvs/srv/Trigger')}


@needs_stand_in
@pytest.mark.parametrize('what', REFUSED)
def test_what_only_rosbag2_does_is_refused_by_name(tmp_path, what):
    with pytest.raises(RuntimeError, match=f"{what} needs ROS 2's own rosbag2"):
        REFUSED[what](tmp_path)


def topic(name, kind='std_msgs/msg/String', **more):
    return TopicMetadata(id=0, name=name, type=kind, serialization_format='cdr', **more)


def write(path, storage, writer=None, split=False):
    """Ten messages each of /text and /log, 100 ns apart."""
    writer = writer or SequentialWriter()
    writer.open(StorageOptions(uri=str(path), storage_id=storage), ConverterOptions('', ''))
    writer.create_topic(topic('/text'))
    writer.create_topic(topic('/log', 'rcl_interfaces/msg/Log'))
    for number in range(10):
        writer.write('/text', serialize_message(String(data=f'Hello {number}')), 100 * number)
        writer.write('/log', serialize_message(Log(level=number)), 100 * number, 100 * number + 1)
        if split and number == 4:
            writer.split_bagfile()
    return path


def opened(path, reader=None):
    reader = reader or SequentialReader()
    reader.open(StorageOptions(uri=str(path)), ConverterOptions())
    return reader


def rest(reader, most=100):
    """(topic, time) of the next messages."""
    found = []
    while len(found) < most and reader.has_next():
        name, _, stamp = reader.read_next()
        found.append((name, stamp))
    return found


@pytest.mark.parametrize('storage', STORAGES)
@pytest.mark.parametrize('split', [False, True])
def test_the_tutorials_loop_reads_what_was_written(tmp_path, storage, split):
    reader = opened(write(tmp_path / 'bag', storage, split=split))
    types = {one.name: one.type for one in reader.get_all_topics_and_types()}
    assert types == {'/text': 'std_msgs/msg/String', '/log': 'rcl_interfaces/msg/Log'}
    found = []
    while reader.has_next():
        name, data, stamp = reader.read_next()
        found.append((name, deserialize_message(data, get_message(types[name])), stamp))
    assert [(message.data, stamp) for name, message, stamp in found if name == '/text'] == [(f'Hello {k}', 100 * k) for k in range(10)]
    assert [message.level for name, message, _ in found if name == '/log'] == list(range(10))
    with pytest.raises(RuntimeError, match='Bag is at end'):
        reader.read_next()
    metadata = reader.get_metadata()
    assert (metadata.message_count, metadata.duration.nanoseconds, metadata.starting_time.nanoseconds) == (20, 900, 0)
    assert [file.message_count for file in metadata.files] == ([10, 10] if split else [20])


@pytest.mark.parametrize('storage', STORAGES)
def test_filters_continue_where_the_reader_stands_and_seek_keeps_them(tmp_path, storage):
    reader = opened(write(tmp_path / 'bag', storage, split=True))
    assert rest(reader, 3) == [('/text', 0), ('/log', 0), ('/text', 100)]
    reader.set_filter(StorageFilter(topics=['/log']))
    assert rest(reader, 2) == [('/log', 100), ('/log', 200)]
    reader.reset_filter()
    assert rest(reader, 2) == [('/text', 300), ('/log', 300)]
    reader.set_filter(StorageFilter(topics=['/text']))
    reader.seek(750)
    assert rest(reader) == [('/text', 800), ('/text', 900)]
    reader.seek(350)
    assert len(rest(reader)) == 6


@pytest.mark.parametrize('given, expected', [
    ({'regex': '/.*'}, 20), ({'regex': 'text'}, 0), ({'topics': ['/text'], 'regex': '/l.*'}, 20), ({'exclude_topics': ['/text']}, 10),
    ({'regex_to_exclude': '.*log'}, 10), ({'topics': ['/text', '/log'], 'exclude_topics': ['/log']}, 10), ({'topics': ['/none']}, 0)])
def test_a_filter_takes_names_and_expressions(tmp_path, given, expected):
    reader = opened(write(tmp_path / 'bag', 'mcap'))
    reader.set_filter(StorageFilter(**given))
    assert len(rest(reader)) == expected


@pytest.mark.parametrize('storage', STORAGES)
@pytest.mark.parametrize('mode', ['MESSAGE', 'FILE'])
def test_compressed_bags_are_written_and_read(tmp_path, storage, mode):
    options = CompressionOptions(compression_format='zstd', compression_mode=getattr(CompressionMode, mode), compression_queue_size=0,
                                 compression_threads=1)
    path = write(tmp_path / 'bag', storage, SequentialCompressionWriter(options))
    reader = opened(path, SequentialCompressionReader())
    name, data, stamp = reader.read_next()
    assert (name, deserialize_message(data, String).data, stamp) == ('/text', 'Hello 0', 0)
    assert len(rest(reader)) == 19
    assert (reader.get_metadata().compression_format, reader.get_metadata().compression_mode.upper()) == ('zstd', mode)


@pytest.mark.parametrize('storage', STORAGES)
def test_a_lost_metadata_file_is_made_again(tmp_path, storage):
    path = write(tmp_path / 'bag', storage, split=True)
    (path / 'metadata.yaml').unlink()
    rosbag2_py.Reindexer().reindex(StorageOptions(uri=str(path), storage_id=storage))
    found = rosbag2_py.Info().read_metadata(str(path), storage)
    assert (found.message_count, found.storage_identifier, len(found.relative_file_paths)) == (20, storage, 2)
    again = rosbag2_py.MetadataIo().deserialize_metadata(rosbag2_py.MetadataIo().serialize_metadata(found))
    assert {one.topic_metadata.name: one.message_count for one in again.topics_with_message_count} == {'/text': 10, '/log': 10}
    assert len(rest(opened(path))) == 20


@pytest.mark.parametrize('storage', STORAGES)
def test_definitions_of_types_are_in_the_bag(tmp_path, storage):
    found = {one.topic_type: one for one in opened(write(tmp_path / 'bag', storage)).get_all_message_definitions()}
    assert set(found) == {'std_msgs/msg/String', 'rcl_interfaces/msg/Log'}
    assert {one.encoding for one in found.values()} == {'ros2msg'}
    text = found['rcl_interfaces/msg/Log'].encoded_message_definition
    assert 'uint8 level' in text and 'MSG: builtin_interfaces/Time' in text


def test_definitions_are_found_by_either_form_of_a_name():
    source = rosbag2_py.LocalMessageDefinitionSource()
    assert source.get_full_text('some_pkg').encoding == 'unknown' and source.get_full_text('some_pkg').encoded_message_definition == ''
    short, full = (source.get_full_text(f'std_msgs/{part}String') for part in ('', 'msg/'))
    assert short.encoded_message_definition == full.encoded_message_definition != ''
    with pytest.raises(IndexError, match='no_such_package'):
        source.get_full_text('no_such_package/msg/Gone')


@pytest.mark.parametrize('storage', STORAGES)
def test_offered_qos_comes_back(tmp_path, storage):
    text = ('- {history: keep_last, depth: 7, reliability: best_effort, durability: transient_local, liveliness: automatic, '
            'deadline: {sec: 1, nsec: 5}, lifespan: {sec: 0, nsec: 0}, liveliness_lease_duration: {sec: 0, nsec: 0}, '
            'avoid_ros_namespace_conventions: false}')
    offered = rosbag2_py.to_rclcpp_qos_vector(text, 9)
    writer = SequentialWriter()
    writer.open(StorageOptions(uri=str(tmp_path / 'bag'), storage_id=storage), ConverterOptions())
    writer.create_topic(topic('/text', offered_qos_profiles=offered))
    writer.close()
    stored, = rosbag2_py.MetadataIo().read_metadata(str(tmp_path / 'bag')).topics_with_message_count[0].topic_metadata.offered_qos_profiles
    profile = rosbag2_py.convert_rclcpp_qos_to_rclpy_qos(stored)
    assert isinstance(profile, QoSProfile)
    assert (profile.depth, profile.reliability, profile.durability, profile.deadline.nanoseconds) == \
        (7, ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.TRANSIENT_LOCAL, 1_000_000_005)


def test_the_example_of_rosbag2_runs(tmp_path):
    # Names as rosbag2_examples_py uses them, the private module included.
    writer = SequentialWriter()
    writer.open(rosbag2_py._storage.StorageOptions(uri=str(tmp_path / 'my_bag'), storage_id='sqlite3'),
                rosbag2_py._storage.ConverterOptions('', ''))
    writer.create_topic(rosbag2_py._storage.TopicMetadata(id=0, name='chatter', type='std_msgs/msg/String', serialization_format='cdr'))
    writer.write('chatter', serialize_message(String(data='hello')), 5)
    del writer
    assert rest(opened(tmp_path / 'my_bag')) == [('chatter', 5)]


def test_misuse_is_a_runtime_error(tmp_path):
    with pytest.raises(RuntimeError, match='Bag is not open'):
        SequentialReader().has_next()
    with pytest.raises(RuntimeError, match='Bag is not open'):
        SequentialWriter().write('/text', b'', 0)
    with pytest.raises(RuntimeError, match='No storage could be initialized'):
        SequentialReader().open_uri(str(tmp_path / 'nothing'))
    path = write(tmp_path / 'bag', 'mcap')
    with pytest.raises(RuntimeError, match='already exists'):
        SequentialWriter().open(StorageOptions(uri=str(path)), ConverterOptions())
    with pytest.raises(RuntimeError, match='No storage could be initialized'):
        SequentialWriter().open(StorageOptions(uri=str(tmp_path / 'other'), storage_id='tape'), ConverterOptions())
    reader = opened(path)
    assert reader.set_read_order(ReadOrder()) and not reader.set_read_order(ReadOrder(ReadOrderSortBy.PublishedTimestamp, False))


def test_registered_plugins_and_modes():
    assert rosbag2_py.get_registered_readers() >= set(STORAGES) and rosbag2_py.get_registered_writers() >= set(STORAGES)
    assert 'zstd' in rosbag2_py.get_registered_compressors() and rosbag2_py.get_default_storage_id() == 'mcap'
    assert isinstance(rosbag2_py.get_registered_serializers(), set)
    for mode in ('NONE', 'MESSAGE', 'FILE'):
        assert rosbag2_py.compression_mode_to_string(rosbag2_py.compression_mode_from_string(mode)) == mode

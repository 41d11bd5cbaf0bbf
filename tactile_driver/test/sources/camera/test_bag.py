# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tactile_driver.errors import BadArgument, BadFrame, BadRecording
from tactile_driver.sources.base.protocol import EndOfSource
from tactile_driver.sources.camera.bag import BagSource, choose_topic

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
START, PERIOD = 1_700_000_000_123_000_000, 20_000_000
K = (600.0, 0.0, 32.0, 0.0, 600.0, 24.0, 0.0, 0.0, 1.0)


def header(k):
    stamp = START + k * PERIOD
    return TYPES['std_msgs/msg/Header'](TYPES['builtin_interfaces/msg/Time'](stamp // 10**9, stamp % 10**9), 'pad')


def image(k, encoding='bgr8', channels=3):
    data = np.full(48 * 64 * channels, k, np.uint8)
    return TYPES['sensor_msgs/msg/Image'](header(k), 48, 64, encoding, 0, 64 * channels, data)


def info():
    roi = TYPES['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
    matrices = np.zeros(5), np.array(K), np.eye(3).ravel(), np.zeros(12)
    return TYPES['sensor_msgs/msg/CameraInfo'](header(0), 48, 64, 'plumb_bob', *matrices, 0, 0, roi)


def write(path, topics, storage=StoragePlugin.MCAP):
    """A bag of topic -> messages; message k of each was recorded 5 ms after its stamp."""
    with Writer(path, version=9, storage_plugin=storage) as writer:
        for topic, messages in topics.items():
            kind = messages[0].__msgtype__
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for k, message in enumerate(messages):
                writer.write(connection, START + k * PERIOD + 5_000_000, STORE.serialize_cdr(message, kind))
    return path


def opened(path, topic='', rate=0.0, loop=False):
    source = BagSource(str(path), topic, rate, loop)
    source.open()
    return source


@pytest.fixture(params=[StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def bag(tmp_path, request):
    return write(tmp_path / 'bag', {'/pad/image_raw': [image(k) for k in range(6)], '/pad/camera_info': [info()]}, request.param)


def test_images_keep_their_stamps_in_both_storages(bag):
    source = opened(bag)
    frames = [source.read() for _ in range(6)]
    assert [f.stamp_ns for f in frames] == [START + k * PERIOD for k in range(6)]
    assert [int(f.image[0, 0, 0]) for f in frames] == list(range(6))
    with pytest.raises(EndOfSource):
        source.read()


def test_the_recorded_camera_info_is_used_again(bag):
    calibration = opened(bag).calibration()
    assert (calibration.k, calibration.width, calibration.height, calibration.model) == (K, 64, 48, 'plumb_bob')


def test_at_the_bags_own_pace(bag):
    source = opened(bag, rate=-1.0)
    start = time.monotonic()
    for _ in range(6):
        source.read()
    assert time.monotonic() - start == pytest.approx(0.1, abs=0.06)


def test_a_loop_begins_again_with_the_recorded_stamps(bag):
    source = opened(bag, loop=True)
    stamps = [source.read().stamp_ns for _ in range(8)]
    assert stamps[6:] == stamps[:2]


def test_unwanted_frames_are_passed_over(bag):
    source = opened(bag)
    assert source.read(wanted=False) is None
    assert source.read().stamp_ns == START + PERIOD


def compressed(k):
    data = cv2.imencode('.png', np.full((48, 64, 3), 90 + k, np.uint8))[1]
    return TYPES['sensor_msgs/msg/CompressedImage'](header(k), 'png', data)


@pytest.mark.parametrize('wanted', ['', 'image_raw/compressed', '/pad/image_raw/compressed', 'image_raw', '/pad/image_raw'])
def test_compressed_images_take_the_place_of_raw_ones(tmp_path, wanted):
    path = write(tmp_path / 'bag', {'/pad/image_raw/compressed': [compressed(0), compressed(1)], '/pad/camera_info': [info()],
                                    '/pad/image_annotated': [image(7)]})
    source = opened(path, wanted)
    assert [(source.read().image == 90 + k).all() for k in range(2)] == [True, True] and source.calibration().k == K


@pytest.mark.parametrize('wanted, value', [('', 7), ('image_raw', 7), ('image_raw/compressed', 90), ('/pad/image_raw/compressed', 90)])
def test_raw_images_come_before_compressed_ones(tmp_path, wanted, value):
    path = write(tmp_path / 'bag', {'/pad/image_raw/compressed': [compressed(0)], '/pad/image_raw': [image(7)]})
    assert (opened(path, wanted).read().image == value).all()


def test_a_corrupt_compressed_image_is_bad_and_the_next_one_good(tmp_path):
    cut = compressed(0)
    cut.data = cut.data[:-9]
    source = opened(write(tmp_path / 'bag', {'/image_raw/compressed': [cut, compressed(1)]}))
    with pytest.raises(BadFrame, match='/image_raw at .* the frame is cut'):
        source.read()
    assert (source.read().image == 91).all()


def test_grey_and_unusable_encodings(tmp_path):
    path = write(tmp_path / 'bag', {'/image_raw': [image(1, 'mono8', 1), image(2, '32FC1', 4), image(3, 'rgb8')]})
    source = opened(path)
    assert source.read().encoding == 'mono8'
    with pytest.raises(BadFrame, match='32FC1'):
        source.read()
    assert source.read().encoding == 'bgr8'


def test_a_broken_message_is_bad_and_the_next_one_good(tmp_path):
    path = tmp_path / 'bag'
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/image_raw', 'sensor_msgs/msg/Image', typestore=STORE)
        writer.write(connection, START, b'\x00\x01\x00\x00\x01\x02')
        writer.write(connection, START + PERIOD, STORE.serialize_cdr(image(1), 'sensor_msgs/msg/Image'))
    source = opened(path)
    with pytest.raises(BadFrame, match='/image_raw'):
        source.read()
    assert source.read().stamp_ns == START + PERIOD


@pytest.mark.parametrize(('wanted', 'chosen'), [('', None), ('/left/image_raw', '/left/image_raw'), ('left/image_raw', '/left/image_raw'),
                                                ('/other', None)])
def test_topics_are_chosen_or_listed(wanted, chosen):
    types = {'/left/image_raw': 'sensor_msgs/msg/Image', '/right/image_raw': 'sensor_msgs/msg/Image', '/dots': 'tactile_msgs/msg/DotTracks'}
    if chosen:
        assert choose_topic(types, wanted, 'bag') == chosen
    else:
        with pytest.raises(BadRecording, match='/left/image_raw, /right/image_raw'):
            choose_topic(types, wanted, 'bag')


def test_the_sensors_images_are_chosen_among_others():
    types = dict.fromkeys(['/pad/image_raw', '/pad/image_annotated', '/cam/image_color'], 'sensor_msgs/msg/Image')
    assert choose_topic(types, '', 'bag') == '/pad/image_raw'
    with pytest.raises(BadRecording, match='3 image topics .*name one'):
        choose_topic({**types, '/other/image_raw': 'sensor_msgs/msg/Image', '/pad/image_annotated': 'std_msgs/msg/String'}, '', 'bag')


def test_a_bag_with_its_last_part_cut_off_plays_as_far_as_it_goes(tmp_path):
    rng, messages = np.random.default_rng(5), []
    for k in range(60):  # noise does not compress: chunks are of several messages each
        messages.append(TYPES['sensor_msgs/msg/Image'](header(k), 48, 64, 'mono8', 0, 64, rng.integers(0, 256, 48 * 64, np.uint8)))
    path = write(tmp_path / 'bag', {'/pad/image_raw': messages * 1, '/pad/image_annotated': messages[:1]})
    whole = opened(path)
    count = sum(1 for _ in iter(lambda: whole.read().stamp_ns >= START + 59 * PERIOD, True)) + 1
    file, = path.glob('*.mcap')
    file.write_bytes(file.read_bytes()[:file.stat().st_size * 7 // 10])
    (path / 'metadata.yaml').unlink()
    source, stamps = opened(path), []
    with pytest.raises(EndOfSource):
        while True:
            stamps.append(source.read().stamp_ns)
    assert count == 60 and 10 < len(stamps) < 60
    assert stamps == [START + k * PERIOD for k in range(len(stamps))]
    assert 'cut off' in source.remark


@pytest.mark.parametrize('content', ['nothing', 'folder', 'broken'])
def test_what_is_no_bag_is_named(tmp_path, content):
    path = tmp_path / 'bag'
    if content != 'nothing':
        path.mkdir()
    if content == 'broken':
        (path / 'metadata.yaml').write_text('rosbag2_bagfile_information: {version: 9}')
    with pytest.raises(BadRecording, match=str(path)):
        opened(path)


def test_a_bag_without_images(tmp_path):
    with pytest.raises(BadRecording, match='none'):
        opened(write(tmp_path / 'bag', {'/camera_info': [info()]}))


def test_without_a_path():
    with pytest.raises(BadArgument, match='path'):
        BagSource('', '', -1.0, False)

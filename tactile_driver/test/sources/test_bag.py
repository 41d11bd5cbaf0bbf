# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Images, voltages and taxel images of recordings."""

import time

import cv2
import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rosbag2_py import ConverterOptions, SequentialWriter, StorageOptions, TopicMetadata
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from std_msgs.msg import Header

from tactile_driver.errors import BadFrame, BadRecording
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.recordings.serialization import encode, type_name_of
from tactile_driver.recordings.writer import write_messages
from tactile_driver.sources.bag import BagSource, PsdBagSource, TaxelBagSource, choose_topic
from tactile_driver.sources.source import EndOfSource
from tactile_msgs.msg import PsdVoltages

START, PERIOD = 1_700_000_000_123_000_000, 20_000_000
K = (600.0, 0.0, 32.0, 0.0, 600.0, 24.0, 0.0, 0.0, 1.0)


def header(k):
    stamp = START + k * PERIOD
    return Header(stamp=Time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id='pad')


def image(k, encoding='bgr8', channels=3):
    return Image(header=header(k), height=48, width=64, encoding=encoding, step=64 * channels, data=bytes([k]) * (48 * 64 * channels))


def info():
    return CameraInfo(header=header(0), height=48, width=64, distortion_model='plumb_bob', d=[0.0] * 5, k=K)


def write(path, topics):
    """A bag of topic -> messages, or their bytes as images; message k of each was recorded 5 ms after its stamp."""
    writer = SequentialWriter()
    writer.open(StorageOptions(uri=str(path), storage_id='mcap'), ConverterOptions())
    for number, (topic, messages) in enumerate(topics.items()):
        kind = type_name_of(type(messages[-1]))
        writer.create_topic(TopicMetadata(id=number, name=topic, type=kind, serialization_format='cdr'))
        for k, message in enumerate(messages):
            writer.write(topic, message if isinstance(message, bytes) else encode(message)[1], START + k * PERIOD + 5_000_000)
    writer.close()
    return path


def opened(path, topic='', rate=0.0, loop=False):
    return opened_as(BagSource, path, topic, rate=rate, loop=loop)


def opened_as(kind, path, topic='', **values):
    source = kind({'path': str(path), 'topic': topic, 'rate': 0.0, 'loop': False, 'transposed': False, **values}, time.time_ns)
    source.open()
    return source


@pytest.fixture
def bag(tmp_path):
    return write(tmp_path / 'bag', {'/pad/image_raw': [image(k) for k in range(6)], '/pad/camera_info': [info()]})


def test_images_keep_their_stamps(bag):
    source = opened(bag)
    frames = [source.read() for _ in range(6)]
    assert [f.stamp_ns for f in frames] == [START + k * PERIOD for k in range(6)]
    assert [int(f.image[0, 0, 0]) for f in frames] == list(range(6))
    with pytest.raises(EndOfSource):
        source.read()


def test_the_recorded_camera_info_is_used_again(bag):
    calibration, = opened(bag).calibrations()
    assert (calibration.k, calibration.width, calibration.height, calibration.model) == (K, 64, 48, 'plumb_bob')


def test_at_the_bags_own_pace(bag):
    start = time.monotonic()
    source = opened(bag, rate=-1.0)
    for _ in range(6):
        source.read()
    assert time.monotonic() - start > 0.095  # a busy machine is slower


def test_a_loop_begins_again_with_the_recorded_stamps(bag):
    source = opened(bag, loop=True)
    stamps = [source.read().stamp_ns for _ in range(8)]
    assert stamps[6:] == stamps[:2]


def compressed(k):
    data = cv2.imencode('.png', np.full((48, 64, 3), 90 + k, np.uint8))[1]
    return CompressedImage(header=header(k), format='png', data=data.tobytes())


@pytest.mark.parametrize('wanted', ['', 'image_raw/compressed', '/pad/image_raw/compressed', 'image_raw', '/pad/image_raw'])
def test_compressed_images_take_the_place_of_raw_ones(tmp_path, wanted):
    path = write(tmp_path / 'bag', {'/pad/image_raw/compressed': [compressed(0), compressed(1)], '/pad/camera_info': [info()],
                                    '/pad/image_annotated': [image(7)]})
    source = opened(path, wanted)
    assert [(source.read().image == 90 + k).all() for k in range(2)] == [True, True] and source.calibrations()[0].k == K


def test_a_corrupt_compressed_image_is_bad_and_the_next_one_good(tmp_path):
    cut = compressed(0)
    cut.data = cut.data[:-9]
    source = opened(write(tmp_path / 'bag', {'/image_raw/compressed': [cut, compressed(1)]}))
    with pytest.raises(BadFrame, match='/image_raw at .* is truncated; it is skipped'):
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
    path = write(tmp_path / 'bag', {'/image_raw': [b'\x00\x01\x00\x00\x01\x02', image(1)]})
    source = opened(path)
    with pytest.raises(BadFrame, match='/image_raw'):
        source.read()
    assert source.read().stamp_ns == START + PERIOD


@pytest.mark.parametrize(('wanted', 'selected'), [('', None), ('/left/image_raw', '/left/image_raw'), ('left/image_raw', '/left/image_raw'),
                                                ('/other', None)])
def test_topics_are_chosen_or_listed(wanted, selected):
    types = {'/left/image_raw': 'sensor_msgs/msg/Image', '/right/image_raw': 'sensor_msgs/msg/Image', '/dots': 'tactile_msgs/msg/DotTracks'}
    if selected:
        assert choose_topic(types, wanted, 'bag') == selected
    else:
        with pytest.raises(BadRecording, match='/left/image_raw, /right/image_raw'):
            choose_topic(types, wanted, 'bag')


def test_the_sensors_images_are_chosen_among_others():
    types = dict.fromkeys(['/pad/image_raw', '/pad/image_annotated', '/cam/image_color'], 'sensor_msgs/msg/Image')
    assert choose_topic(types, '', 'bag') == '/pad/image_raw'
    with pytest.raises(BadRecording, match='3 image topics .*name one'):
        choose_topic({**types, '/other/image_raw': 'sensor_msgs/msg/Image', '/pad/image_annotated': 'std_msgs/msg/String'}, '', 'bag')


@pytest.mark.parametrize('content', ['nothing', 'folder', 'broken'])
def test_what_is_no_bag_is_named(tmp_path, content):
    path = tmp_path / 'bag'
    if content != 'nothing':
        path.mkdir()
    if content == 'broken':
        (path / 'metadata.yaml').write_text('rosbag2_bagfile_information: {version: 9}')
    with pytest.raises(BadRecording, match=str(path)):
        opened(path)


def write_bag(path, counts):
    """A bag of messages with so many voltages each."""
    stamps = [5 * 10**9 + 1000 * k for k in range(len(counts))]
    write_messages(path, 'finger', ((stamp, 'voltages', PsdVoltages(header=header_of(stamp, 'finger'), sample_period=2e-4,
                                                                    voltages=list(map(float, range(count)))))
                                    for stamp, count in zip(stamps, counts)))
    return path


def test_voltages_keep_their_stamps(tmp_path):
    source = opened_as(PsdBagSource, write_bag(tmp_path / 'bag', [8, 3, 12]))
    first = source.read()
    assert (first.stamp_ns, first.period_s, first.volts.tolist()) == (5 * 10**9, 2e-4, [[0, 1, 2, 3], [4, 5, 6, 7]])
    with pytest.raises(BadFrame, match='a sample has four'):
        source.read()
    assert source.read().volts.shape == (3, 4)
    with pytest.raises(EndOfSource):
        source.read()


def test_a_topic_without_voltages(tmp_path):
    with pytest.raises(BadRecording, match='voltage topics: /finger/voltages'):
        opened_as(PsdBagSource, write_bag(tmp_path / 'bag', [4]), 'image_raw')


def bag_of(path, images):
    """A bag of (values, encoding), one a second."""
    write_messages(path, 'pad', ((10**9 * k, 'image_raw', Image(
        header=header_of(10**9 * k, 'pad'), height=values.shape[0], width=values.shape[1], encoding=encoding, step=values.strides[0],
        data=values.tobytes())) for k, (values, encoding) in enumerate(images, 1)))
    return path


def test_all_bits_and_stamps_come_back(tmp_path):
    wide = np.array([[1, 1000, 65535], [0, 256, 4095]], np.uint16)
    path = bag_of(tmp_path / 'b', [(wide, 'mono16'), (wide.astype(np.uint8), 'mono8')])
    source = opened_as(TaxelBagSource, path, rows=2, columns=3)
    frames = [source.read(), source.read()]
    assert frames[0].image.tolist() == wide.tolist() and [frame.encoding for frame in frames] == ['mono16', 'mono8']
    assert [frame.stamp_ns for frame in frames] == [10**9, 2 * 10**9]
    with pytest.raises(EndOfSource):
        source.read()
    source.close()


def test_colour_and_other_sizes_are_skipped(tmp_path):
    path = bag_of(tmp_path / 'b', [(np.zeros((2, 9), np.uint8), 'bgr8'), (np.zeros((3, 3), np.uint8), 'mono8')])
    source = opened_as(TaxelBagSource, path, rows=2, columns=3)
    for reason in ('encoding .bgr8. is not supported', 'it is skipped'):
        with pytest.raises(BadFrame, match=reason):
            source.read()
    source.close()

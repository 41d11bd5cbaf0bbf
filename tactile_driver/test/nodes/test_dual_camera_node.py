# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""dual_camera_node: its stream, its topics as a source, its life."""

import itertools

import numpy as np
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from fake_source import FakeSource
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import CameraInfo, Image, TimeReference
from stitchings import SIZE, stitching, view
from waiting import until
from watching import stamps

from tactile_driver.camera.pairs import NAMES
from tactile_driver.frame import CameraCalibration, Frame, PairFrame
from tactile_driver.nodes import topic_source
from tactile_driver.nodes.dual_camera_node import DualCameraNode
from tactile_driver.nodes.messages.conversions import header_of, image_to_message, stamp_ns_of
from tactile_driver.nodes.runtime.ros_defaults import LATCHED_QOS
from tactile_driver.nodes.topic_source import TopicSource
from tactile_driver.sources.registry import DUAL_CAMERA_SOURCES
from tactile_driver.sources.source import NothingYet
from tactile_driver.stitching.methods import make_stitcher


def pair_of(size):
    """Makes the pair of a number: grey, the right frame a millisecond later."""
    return lambda number: PairFrame(*(Frame(np.full(size[::-1], value, np.uint8), number * 10**7 + late, 'mono8')
                                      for value, late in ((50, 0), (90, 10**6))))


def stitching_file(folder):
    """Path of a calibration file in the folder that holds stitching()."""
    path = folder / 'calibration.yaml'
    path.write_text(yaml.safe_dump({'fitted': {'stitching': stitching().to_dict()}}))
    return str(path)


@pytest.fixture
def streamed(driven, tmp_path, monkeypatch):
    """streamed(**parameters): the node with pairs of this size; stitched: by stitching()."""
    def make(size=SIZE, stitched=True, calibrations=(None, None), **values):
        fake = FakeSource(make=pair_of(size), about={'shutter offset (ms)': 9.0}, known=calibrations)
        monkeypatch.setitem(DUAL_CAMERA_SOURCES, 'device', lambda _values, _clock: fake)
        return driven(DualCameraNode, source='device', stitching_path=stitching_file(tmp_path) if stitched else '', **values)
    return make


def test_each_view_has_its_stamp_and_its_calibration_and_the_picture_the_left_stamp(streamed):
    known = tuple(CameraCalibration(*SIZE, (k,) * 9) for k in (7.0, 8.0))
    two = streamed(frame_id='pad', calibrations=known)
    *images, exposed, left_info, right_info = two.received(
        ('left/image_raw', Image), ('right/image_raw', Image), ('image_raw', Image), ('right/time_reference', TimeReference),
        ('left/camera_info', CameraInfo), ('right/camera_info', CameraInfo))
    left, right, whole = images
    assert [stamp_ns_of(message.header) % 10**7 for message in (*images, exposed)] == [0, 10**6, 0, 0]
    assert exposed.time_ref.sec * 10**9 + exposed.time_ref.nanosec == stamp_ns_of(exposed.header) + 10**6
    assert exposed.source == 'right camera'
    assert set(left.data) == {50} and set(right.data) == {90} and {50, 90} <= set(whole.data)
    assert (whole.width, whole.height) == (121, 61) and {m.header.frame_id for m in (*images, exposed)} == {
        f'pad_{view}camera_optical' for view in ('', 'left_', 'right_')}
    assert set(left_info.k) == {7.0} and set(right_info.k) == {8.0}
    status = two.reported(lambda status: status.message.endswith(' Hz'))
    assert {each.key: each.value for each in status.values}['shutter offset (ms)'] == '9'


def test_the_views_are_grey_or_coloured_as_asked(streamed):
    image, = streamed(encoding='bgr8').received(('image_raw', Image))
    assert (image.encoding, image.step) == ('bgr8', 363)


def test_without_a_stitching_the_views_are_put_side_by_side_and_that_is_said(streamed):
    two = streamed(stitched=False, overlap=20)
    whole, = two.received(('image_raw', Image))
    expected = np.repeat([50, 90], SIZE[0] - 10)
    assert (picture_of(whole) == expected).all()
    two.reported(lambda status: 'stitching_path is empty' in status.message)


def test_views_of_another_size_are_warned_of_and_not_stitched(streamed):
    two = streamed((48, 40), calibrations=(CameraCalibration(*SIZE, (7.0,) * 9), None))
    info, _ = two.received(('left/camera_info', CameraInfo), ('right/image_raw', Image))
    assert set(info.k) == {0.0}
    two.reported(lambda status: 'left: the camera calibration is for 96 x 80 px' in status.message)


def subscribed(node):
    return [s.topic_name for s in node.subscriptions]


def test_it_subscribes_only_while_frames_are_wanted(node):
    source = TopicSource(node, 'left/image_raw')
    source.open()
    assert '/left/image_raw' not in subscribed(node) and source.describe()['idle']
    with pytest.raises(NothingYet):
        source.read()
    assert '/left/image_raw' in subscribed(node) and not source.describe()['idle']
    with pytest.raises(NothingYet):
        source.read(False)
    assert source.describe()['idle']
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    for _ in range(1000):  # the node's executor unsubscribes
        executor.spin_once(timeout_sec=0.05)
        if '/left/image_raw' not in subscribed(node):
            break
    assert '/left/image_raw' not in subscribed(node)
    executor.shutdown()
    source.close()
    assert source.calibrations() == (None,)


NODE = 'dual_camera_node'
pytestmark = pytest.mark.full


def views(k=0):
    """Left and right view of a sheet with a pattern that depends on k."""
    found = stitching()
    return [view(side, lambda x, y: 100 + 60 * np.sin(x / 4e-3 + k) + 30 * np.cos(y / 5e-3)) for side in (found.left, found.right)]


def picture_of(message):
    return np.frombuffer(bytes(message.data), np.uint8).reshape(message.height, message.width)


def test_two_image_topics_wait_for_the_camera_info_beside_each_of_them_alone(driven, tmp_path, monkeypatch):
    monkeypatch.setattr(topic_source, 'CAMERA_INFO_PATIENCE_S', 60.0)
    two = driven(DualCameraNode, source='topics', topic='/foreign/left/image_raw', right_topic='/foreign/right/image_raw',
                 stitching_path=stitching_file(tmp_path))
    publishers = [(two.node.create_publisher(Image, f'/foreign/{side}/image_raw', 10),
                   two.node.create_publisher(CameraInfo, f'/foreign/{side}/camera_info', LATCHED_QOS)) for side in NAMES]
    for _image, info in publishers:
        info.publish(CameraInfo(width=SIZE[0], height=SIZE[1], k=[5.0, 0.0, 3.0, 0.0, 5.0, 2.0, 0.0, 0.0, 1.0]))
    whole, numbers, pair = two.collect('image_raw', Image), itertools.count(1), views(0)

    def sent():
        number = next(numbers)
        for (publisher, _info), image in zip(publishers, pair):
            header = header_of(number * 50_000_000, 'theirs')
            publisher.publish(image_to_message(Frame(image, stamp_ns_of(header), 'mono8'), '', header))
        return whole
    assert until(sent, two.executor)


def test_two_image_topics_are_stitched_and_not_published_again(watcher, start, tmp_path):
    publishers = [watcher.node.create_publisher(Image, f'{name}/image_raw', 10) for name in ('left', 'right')]
    whole, reports = watcher.collect(Image, 'image_raw', 100), watcher.collect(DiagnosticArray, '/diagnostics', 10)
    start(source='topics', stitching_path=stitching_file(tmp_path))
    watcher.until(lambda: all(p.get_subscription_count() for p in publishers))
    numbers, pictures = itertools.count(), [views(k) for k in range(6)]
    expected = [make_stitcher('plane', stitching()).stitch(*pair) for pair in pictures]

    def shown(left):
        """The pictures stitched of both views, or with the left half black, after one more of each view that there is."""
        k = next(numbers)
        for side, (publisher, image) in enumerate(zip(publishers, pictures[k % 6])):
            stamp = 10**9 + k * 50_000_000 + side * 3_000_000
            if side == 1 or left:
                publisher.publish(image_to_message(Frame(image, stamp, 'mono8'), '', header_of(stamp, 'pad')))
        watcher.spin(0.05)
        return [m for m in whole if is_of_both(m)] if left else [m for m in whole if is_right_alone(m)]

    def is_of_both(message):
        k, late = divmod(int(stamps([message])[0]) - 10**9, 50_000_000)
        return late == 0 and (picture_of(message) == expected[k % 6]).all()

    def is_right_alone(message):
        picture = picture_of(message)
        return (stamps([message])[0] - 10**9) % 50_000_000 == 3_000_000 and not picture[:, :61].any() and picture[:, 70:].any()
    watcher.until(lambda: len(shown(left=True)) >= 5)
    assert all(watcher.node.count_publishers(f'/{name}/image_raw') == 1 for name in ('left', 'right'))
    watcher.until(lambda: shown(left=False) and any('no left camera' in s.message for m in reports for s in m.status))

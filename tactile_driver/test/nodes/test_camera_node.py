# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""camera_node: its stream and its life."""

import itertools
import time

import cv2
import numpy as np
import pytest
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from fake_source import FakeSource
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import String
from waiting import until
from watching import ERROR, ended, stamps

from tactile_driver.errors import BadArgument, DeviceLost
from tactile_driver.frame import CameraCalibration, load_calibration
from tactile_driver.nodes import topic_source
from tactile_driver.nodes.camera_node import CameraNode
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.nodes.runtime.run import EXIT_FAILURE
from tactile_driver.nodes.topic_source import TopicSource
from tactile_driver.sources.registry import CAMERA_SOURCES


@pytest.fixture
def streamed(driven, monkeypatch):
    """streamed(calibration, **parameters): the node with a FakeSource, and that."""
    def make(calibration=None, **values):
        fake = FakeSource(known=(calibration,))
        monkeypatch.setitem(CAMERA_SOURCES, 'device', lambda _values, _clock: fake)
        return driven(CameraNode, source='device', **values), fake
    return make


def test_nothing_is_decoded_for_nobody(streamed):
    one, fake = streamed()
    assert until(lambda: len(fake.asked) > 5)
    one.close()
    assert not any(fake.asked) and fake.calls == ['open', 'close']


def test_the_end_of_ros_is_no_failure_of_the_camera(streamed):
    _, fake = streamed()
    rclpy.shutdown()
    before = len(fake.asked)
    assert until(lambda: len(fake.asked) > before + 3)


@pytest.mark.parametrize(('calibration', 'values', 'k', 'said'), [
    (CameraCalibration(6, 4, (7.0,) * 9), {}, 7.0, ''),
    (CameraCalibration(64, 48, (7.0,) * 9), {}, 0.0, 'calibration is for 64 x 48 px, but images are 6 x 4 px'),
    (None, {'width': 640}, 0.0, 'gives 6 x 4 px instead of 640 x 4 px')])
def test_a_calibration_is_published_for_its_size_and_another_size_is_warned_of(streamed, calibration, values, k, said):
    one, _ = streamed(calibration, **values)
    info, = one.received(('camera_info', CameraInfo))
    assert set(info.k) == {k} and (info.width, info.height) == (6, 4)
    one.reported(lambda status: said in status.message)


def test_the_description_is_published_only_when_it_changes(driven, monkeypatch):
    class Counting(FakeSource):
        """Makes an equal calibration for each frame, as a simulated sensor does, and counts what it lost."""

        def calibrations(self):
            return (CameraCalibration(64, 48, tuple(float(k) for k in range(1, 10))),)

        def describe(self):
            return {'rate': 0.0, 'lost': len(self.asked)}
    fake = Counting()
    monkeypatch.setitem(CAMERA_SOURCES, 'device', lambda _values, _clock: fake)
    one = driven(CameraNode, source='device')
    images, descriptions = one.collect('image_raw', Image), []
    one.node.create_subscription(String, 'description', descriptions.append, QoSProfile(depth=50))
    assert until(lambda: len(images) > 20, one.executor)
    one.reported(lambda status: 'calibration is for 64 x 48 px' in status.message)
    assert len(descriptions) <= 2, 'one when it is open, one with the size of the first image'
    monkeypatch.setattr(fake, 'describe', lambda: {'rate': 5.0})
    fake.script += [DeviceLost('unplugged')]
    assert until(lambda: 'rate: 5.0' in descriptions[-1].data, one.executor)
    about = yaml.safe_load(descriptions[-1].data)
    assert (about['width'], about['height']) == (6, 4), 'the size of the images is still known'


NODE = 'camera_node'
pytestmark = pytest.mark.full


def test_set_camera_info_writes_the_file_of_camera_info_url_and_takes_it(watcher, start, video, tmp_path):
    infos = watcher.collect(CameraInfo, 'camera_info')
    start(source='file', path=video, loop='true', camera_info_url=tmp_path / 'lens.yaml')
    watcher.until(lambda: infos and set(infos[-1].k) == {0.0})
    known = CameraInfo(width=64, height=48, distortion_model='plumb_bob', d=[0.0] * 5, k=[50.0, 0, 32, 0, 50, 24, 0, 0, 1],
                       r=[1.0, 0, 0, 0, 1, 0, 0, 0, 1], p=[50.0, 0, 32, 0, 0, 50, 24, 0, 0, 0, 1, 0])
    refused = watcher.call(SetCameraInfo, 'set_camera_info', SetCameraInfo.Request())
    assert not refused.success and 'not calibrated' in refused.status_message
    assert watcher.call(SetCameraInfo, 'set_camera_info', SetCameraInfo.Request(camera_info=known)).success
    watcher.until(lambda: infos[-1].k[0] == 50.0)
    assert load_calibration(str(tmp_path / 'lens.yaml')).k == tuple(known.k)


def test_a_video_is_a_camera(watcher, start, video):
    images, infos = watcher.collect(Image, 'image_raw'), watcher.collect(CameraInfo, 'camera_info')
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    process = start(source='file', path=video, loop='true')
    watcher.until(lambda: len(set(stamps(images)) & set(stamps(infos))) >= 60)
    first = images[0]
    assert (first.width, first.height, first.encoding, first.header.frame_id) == (64, 48, 'bgr8', 'touchpad_camera_optical')
    assert np.diff(stamps(images)).min() == pytest.approx(20e6, rel=0.05), 'some are lost on a busy machine'
    assert time.time_ns() - stamps(images)[-1] < 20e9, 'of now, not of the film'
    assert set(infos[0].k) == {0.0} and infos[0].width == 64
    descriptions = watcher.collect(String, 'description', latched)
    watcher.until(lambda: descriptions)
    about = yaml.safe_load(descriptions[-1].data)
    assert (about['source'], about['width'], about['rate'], about['sensor_type']) == ('file', 64, 50.0, 'touchpad')
    assert ended(process) == (0, '')


def test_publishers_are_reliable_and_only_slow_facts_are_latched(driven):
    camera = driven(CameraNode, scene='rest', width=320, height=240).node
    topics = ('image_raw', 'camera_info', 'description', 'ground_truth/slip')
    assert until(lambda: all(camera.get_publishers_info_by_topic(topic) for topic in topics))
    offered = {topic: camera.get_publishers_info_by_topic(topic)[0].qos_profile for topic in topics}
    assert {each.reliability for each in offered.values()} == {ReliabilityPolicy.RELIABLE}
    assert [topic for topic in topics if offered[topic].durability == DurabilityPolicy.TRANSIENT_LOCAL] == ['camera_info', 'description']
    assert offered['image_raw'].durability == offered['ground_truth/slip'].durability == DurabilityPolicy.VOLATILE


def test_a_missing_device_is_reported_and_does_not_end_the_node(watcher, start, video):
    reports = watcher.collect(DiagnosticArray, '/diagnostics', 10)
    process = start(source='device', device='no-such-serial')
    watcher.until(lambda: any(s.level == ERROR and 'no-such-serial' in s.message for m in reports for s in m.status))
    assert watcher.state() == 'unconfigured'
    images = watcher.collect(Image, 'image_raw')
    assert watcher.put('path', str(video)).successful and watcher.put('source', 'file').successful
    watcher.until(lambda: len(images) > 5)
    assert watcher.state() == 'active'
    code, log = ended(process)
    assert code == 0 and log.count('no-such-serial') == 1


def test_nonsense_is_named_once_and_ends_it(start):
    process = start(rate='abc', width=-5, source='nonsense')
    log = process.communicate(timeout=60)[1]
    assert process.returncode == EXIT_FAILURE
    for part in ("parameter rate is 'abc'", 'parameter width is -5', '0 to 8192 px', "parameter source is 'nonsense'"):
        assert log.count(part) == 1


@pytest.mark.parametrize('topic', ['/foreign/image_raw', '/foreign/image_raw/compressed'])
def test_images_of_another_drivers_topic_come_in_the_own_frames_with_its_camera_info(driven, topic):
    one = driven(CameraNode, source='topics', topic=topic, frame_id='pad')
    header, grey = header_of(10**9, 'theirs'), np.full((4, 6), 90, np.uint8)
    if topic.endswith('compressed'):
        message = CompressedImage(header=header, data=cv2.imencode('.png', grey)[1].tobytes())
    else:
        message = Image(header=header, height=4, width=6, step=6, encoding='bayer_rggb8', data=grey.tobytes())
    info, publisher = (one.node.create_publisher(*each, 1) for each in ((CameraInfo, '/foreign/camera_info'), (type(message), topic)))
    images, infos = one.collect('image_raw', Image), one.collect('camera_info', CameraInfo)

    def arrived():
        info.publish(CameraInfo(width=6, height=4, k=[5.0, 0.0, 3.0, 0.0, 5.0, 2.0, 0.0, 0.0, 1.0]))
        publisher.publish(message)
        return images and infos and infos[-1].k[0] == 5.0
    assert until(arrived, one.executor)
    assert images[-1].header.frame_id == 'pad_camera_optical' and images[-1].header.stamp.sec == 1
    assert (images[-1].width, images[-1].height, set(images[-1].data)) == (6, 4, {90})


def test_the_first_image_waits_for_a_camera_info_that_is_late(driven, monkeypatch):
    monkeypatch.setattr(topic_source, 'CAMERA_INFO_PATIENCE_S', 60.0)
    one = driven(CameraNode, source='topics', topic='/foreign/image_raw')
    publisher, stamps_s = one.node.create_publisher(Image, '/foreign/image_raw', 1), itertools.count(1)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    info = one.node.create_publisher(CameraInfo, '/foreign/camera_info', latched)
    images, infos = one.collect('image_raw', Image), one.collect('camera_info', CameraInfo)

    def sent():
        publisher.publish(Image(header=header_of(next(stamps_s) * 10**8, 'theirs'), height=4, width=6, step=6, encoding='mono8',
                                data=bytes(24)))
        return publisher.get_subscription_count()
    assert until(sent, one.executor)
    assert [sent() for _ in range(10) if not one.executor.spin_once(timeout_sec=0.05)]
    assert not images and not infos
    info.publish(CameraInfo(width=6, height=4, k=[5.0, 0.0, 3.0, 0.0, 5.0, 2.0, 0.0, 0.0, 1.0]))  # once
    assert until(lambda: sent() and len(images) > 3, one.executor)
    assert {each.k[0] for each in infos} == {5.0}, 'none was published as not calibrated'


def test_images_of_a_recording_that_were_played_before_the_node_listened_are_counted_and_logged_once(driven, capfd):
    one = driven(CameraNode, source='topics', topic='/played/image_raw')
    publisher = one.node.create_publisher(Image, '/played/image_raw', 1)
    picture = Image(height=1, width=2, step=2, encoding='mono8', data=b'12')
    for k in range(5):
        publisher.publish(picture)
    images, stamps_s = one.collect('image_raw', Image), itertools.count(1)
    assert until(lambda: publisher.get_subscription_count(), one.executor)

    def arrived():
        picture.header = header_of(next(stamps_s) * 10**8, 'theirs')
        publisher.publish(picture)
        return len(images) > 3
    assert until(arrived, one.executor)
    one.reported(lambda status: any(each.key == 'missed at start' and each.value == '5' for each in status.values))
    one.reported(lambda status: 'camera' in status.name)
    log = capfd.readouterr().err
    assert log.count('5 messages of /played/image_raw had been published when the first one arrived') == 1, log


@pytest.mark.parametrize(('topic', 'said'), [('image_raw', 'what this node publishes'), ('', 'topic')])
def test_the_own_topic_and_none_are_no_source(node, topic, said):
    with pytest.raises(BadArgument, match=said):
        TopicSource(node, topic)

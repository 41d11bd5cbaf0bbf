# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A stream of pairs of a source that is made here: what is published for whom, and what is said of views that do not fit."""
import time

import numpy as np
import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image, TimeReference
from stitchings import SIZE, stitching
from tactile_driver.camera.pairs import DualSource, ShutterOffset
from tactile_driver.frame import CameraCalibration, Frame, PairFrame
from tactile_driver.nodes.dual_camera_node import DualPublishers, DualStream
from tactile_driver.parameters.drivers import DUAL_CAMERA_PARAMETERS
from tactile_driver.parameters.table import defaults


class TwoCameras(DualSource):
    """Pairs at 100 Hz, the right frame a millisecond later; sides: which views there are."""

    live = True

    def __init__(self, size=SIZE, sides=('left', 'right'), shutters=None):
        self.shutters = shutters
        self.size, self.sides, self.count, self.exposures = size, sides, 0, []

    def read(self, wanted=True):
        time.sleep(0.01)
        self.count += 1
        frames = [Frame(np.full(self.size[::-1], value, np.uint8), self.count * 10**7 + late, 'mono8') if name in self.sides else None
                  for name, value, late in (('left', 50, 0), ('right', 90, 10**6))]
        return PairFrame(*frames) if wanted else None

    def set_exposure(self, exposure):
        self.exposures.append(exposure)

    def close(self):
        pass

    def describe(self):
        return {'source': 'device', 'rate': 100.0}


class Streamed:
    """A stream of TwoCameras and what is received of it."""

    def __init__(self, node, source, known=True, calibrations=(None, None), **values):
        self.node, publishers = node, DualPublishers(node)
        publishers.choose_views(True)
        values = {**defaults(DUAL_CAMERA_PARAMETERS), 'source': 'device', **values}
        self.stream = DualStream(node, publishers, source, values, stitching() if known else None, calibrations)
        node.trigger_configure()
        node.trigger_activate()
        self.executor = SingleThreadedExecutor(context=node.context)
        self.executor.add_node(node)

    def received(self, *topics):
        """The first message on each topic (name, kind) while the stream runs."""
        messages = {name: [] for name, _ in topics}
        for name, kind in topics:
            self.node.create_subscription(kind, name, messages[name].append, qos_profile_sensor_data)
        self.stream.resume()
        end = time.monotonic() + 10
        while not all(messages.values()) and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.05)
        self.executor.shutdown()
        self.stream.stop()
        return [messages[name][0] for name, _ in topics]


def stamp(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_each_view_has_its_stamp_and_the_picture_the_left_ones(node):
    streamed = Streamed(node, TwoCameras(), frame_id='pad')
    found = streamed.received(('left/image_raw', Image), ('right/image_raw', Image), ('image_raw', Image))
    left, right, whole = found
    assert (stamp(left) % 10**7, stamp(right) % 10**7, stamp(whole) % 10**7) == (0, 10**6, 0)
    assert set(left.data) == {50} and set(right.data) == {90} and {50, 90} <= set(whole.data)
    assert (whole.width, whole.height) == (121, 61) and {m.header.frame_id for m in found} == {
        f'pad_{view}camera_optical' for view in ('', 'left_', 'right_')}
    assert streamed.stream.remark == ''


def test_the_right_exposure_of_each_picture_is_told(node):
    found, image = Streamed(node, TwoCameras(), frame_id='pad').received(('right/time_reference', TimeReference), ('image_raw', Image))
    assert stamp(found) % 10**7 == 0 and found.header.frame_id == image.header.frame_id == 'pad_camera_optical'
    assert found.source == 'right camera'
    assert found.time_ref.sec * 10**9 + found.time_ref.nanosec == stamp(found) + 10**6


def test_diagnostics_tell_the_offset_and_warn_beyond_the_limit(node):
    shutters = ShutterOffset(limit_ns=8e6)
    for k in range(20):
        shutters.add(k * 10**7, k * 10**7 + 9_000_000)
    stream = Streamed(node, TwoCameras(shutters=shutters)).stream
    logged = []
    stream._log.warning = lambda key, text: logged.append(text)
    assert stream.health().values['shutter offset (ms)'] == pytest.approx(9.0)
    assert logged == [shutters.remark] and 'max_skew' in shutters.remark
    stream.source.shutters = None
    assert 'shutter offset (ms)' not in stream.health().values
    stream.stop()


def test_the_views_are_grey_or_coloured_as_asked(node):
    image, = Streamed(node, TwoCameras(), encoding='bgr8').received(('image_raw', Image))
    assert (image.encoding, image.step) == ('bgr8', 363)


def test_the_half_of_a_missing_camera_is_black(node):
    source = TwoCameras(sides=('right',))
    image, = Streamed(node, source).received(('image_raw', Image))
    picture = np.frombuffer(bytes(image.data), np.uint8).reshape(61, 121)
    assert not picture[:, :61].any() and (picture[20:40, 70:90] == 90).all() and stamp(image) % 10**7 == 10**6


def test_a_calibration_of_each_camera_is_published(node):
    known = tuple(CameraCalibration(*SIZE, (k,) * 9) for k in (7.0, 8.0))
    streamed = Streamed(node, TwoCameras(), calibrations=known)
    left, right = streamed.received(('left/camera_info', CameraInfo), ('right/camera_info', CameraInfo))
    assert set(left.k) == {7.0} and set(right.k) == {8.0}


def test_views_of_another_size_are_remarked_and_not_stitched(node):
    streamed = Streamed(node, TwoCameras((48, 40)), calibrations=(CameraCalibration(*SIZE, (7.0,) * 9), None))
    info, _ = streamed.received(('left/camera_info', CameraInfo), ('right/image_raw', Image))
    streamed.node.create_subscription(Image, 'image_raw', lambda _: None, qos_profile_sensor_data)
    assert set(info.k) == {0.0} and 'left: the camera calibration is for 96 x 80 px' in streamed.stream.remark


def test_remarks_are_bounded(node):
    stream = Streamed(node, TwoCameras()).stream
    for width in range(1000):
        stream._remark(f'images are {width} px wide')
    stream.stop()
    assert stream.remark.startswith('images are 0 px wide; ') and stream.remark.count('px wide') == 10
    assert 'there were more' in stream.remark


def test_without_a_stitching_the_views_stand_side_by_side(node):
    streamed = Streamed(node, TwoCameras(), known=False, overlap=16)
    image, = streamed.received(('image_raw', Image))
    assert (image.width, image.height) == (2 * 96 - 16, 80) and 'stitching_path is empty' in streamed.stream.remark

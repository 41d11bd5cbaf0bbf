# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo
from tactile_driver.frame import CameraCalibration, Frame
from tactile_driver.nodes.camera_node import ImagePublishers, ImageStream
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources.source import Source


class FakeCamera(Source):
    """A camera of 6 x 4 px and 100 Hz that notes whether its frames were wanted."""

    live = True

    def __init__(self):
        self.wanted, self.closed = [], False

    def read(self, wanted=True):
        time.sleep(0.01)
        self.wanted.append(wanted)
        return Frame(np.full((4, 6, 3), 9, np.uint8), len(self.wanted), 'bgr8') if wanted else None

    def close(self):
        self.closed = True

    def describe(self):
        return {'source': 'device', 'rate': 100.0}


class Streamed:
    """A stream of a FakeCamera and what is received of it."""

    def __init__(self, node, calibration=None, **values):
        self.node, self.camera = node, FakeCamera()
        self.publishers = ImagePublishers(node)
        values = {**defaults(CAMERA_PARAMETERS), 'source': 'device', **values}
        self.stream = ImageStream(node, self.publishers, self.camera, values, calibration)
        node.trigger_configure()
        node.trigger_activate()
        self.executor = SingleThreadedExecutor(context=node.context)
        self.executor.add_node(node)

    def received(self, kind, topic):
        """The first message on topic while the stream runs."""
        messages = []
        self.node.create_subscription(kind, topic, messages.append, qos_profile_sensor_data)
        self.stream.resume()
        end = time.monotonic() + 10
        while not messages and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.05)
        self.executor.shutdown()
        self.stream.stop()
        return messages[0]


def test_nothing_is_decoded_for_nobody(node):
    streamed = Streamed(node)
    streamed.stream.resume()
    time.sleep(0.2)
    streamed.stream.stop()
    assert len(streamed.camera.wanted) > 5 and not any(streamed.camera.wanted)


def test_the_end_of_ros_is_no_failure_of_the_camera(node):
    streamed = Streamed(node)
    streamed.stream.resume()
    rclpy.shutdown(context=node.context)
    before = len(streamed.camera.wanted)
    time.sleep(0.2)
    assert len(streamed.camera.wanted) > before + 3 and streamed.stream.status.state == 'running'
    streamed.stream.stop()


def test_a_calibration_of_this_size_is_published(node):
    info = Streamed(node, CameraCalibration(6, 4, (7.0,) * 9)).received(CameraInfo, 'camera_info')
    assert set(info.k) == {7.0}


@pytest.mark.parametrize(('calibration', 'values', 'said'), [
    (CameraCalibration(64, 48, (7.0,) * 9), {}, 'calibration is for 64 x 48 px, but images are 6 x 4 px'),
    (None, {'width': 640}, 'gives 6 x 4 px instead of 640 x 4 px')])
def test_a_size_that_does_not_fit_is_remarked_and_claims_no_calibration(node, calibration, values, said):
    streamed = Streamed(node, calibration, **values)
    info = streamed.received(CameraInfo, 'camera_info')
    assert set(info.k) == {0.0} and (info.width, info.height) == (6, 4)
    assert said in streamed.stream.remark

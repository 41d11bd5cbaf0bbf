# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import time
from contextlib import suppress

import cv2
import numpy as np
import pytest
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import CompressedImage, Image
from tactile_driver.errors import BadArgument, BadFrame
from tactile_driver.frame import Frame
from tactile_driver.nodes.dual_camera_node import TopicSource
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.sources.source import NothingYet


def message(k):
    return image_to_message(Frame(np.full((4, 6), k, np.uint8), k, 'mono8'), '', header_of(10**9 + k, 'pad'))


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
    for _ in range(100):  # the node's executor unsubscribes
        executor.spin_once(timeout_sec=0.05)
        if '/left/image_raw' not in subscribed(node):
            break
    assert '/left/image_raw' not in subscribed(node)
    executor.shutdown()
    source.close()
    assert source.calibration() is None


def test_images_come_in_their_order_and_the_oldest_are_dropped(node):
    source = TopicSource(node, 'image_raw')
    source._subscribe(True)
    for k in range(6):
        source._take(message(k), 0)
    frames = [source.read() for _ in range(4)]
    assert [f.stamp_ns - 10**9 for f in frames] == [2, 3, 4, 5] and source.skipped == 2
    assert all((f.image == f.stamp_ns - 10**9).all() for f in frames)
    source.close()


def test_images_that_do_not_arrive_are_counted_and_told(node):
    source = TopicSource(node, 'left/image_raw')
    for k in range(60):
        if k < 20 or k % 5:
            source._take(Image(header=header_of(10**18 + 33_333_333 * k, 'pad')), 0)
    assert source.describe()['lost'] == 8 and source.remark.startswith('15 % of left/image_raw are missing')


def test_a_message_that_makes_no_image_is_a_bad_frame(node):
    source = TopicSource(node, 'image_raw')
    source._subscribe(True)
    source._take(Image(encoding='32FC1', height=1, width=1, step=4, data=bytes(4)), 0)
    with pytest.raises(BadFrame, match='32FC1'):
        source.read()
    source.close()


def test_a_topic_named_compressed_brings_compressed_images(node):
    topic, picture = 'left/image_raw/compressed', np.full((4, 6, 3), 90, np.uint8)
    source, publisher = TopicSource(node, topic), node.create_publisher(CompressedImage, topic, 10)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    message = CompressedImage(header=header_of(10**9, 'pad'), format='jpeg', data=cv2.imencode('.png', picture)[1].tobytes())
    frame, end = None, time.monotonic() + 20
    while frame is None and time.monotonic() < end:
        with suppress(NothingYet):
            frame = source.read()
        publisher.publish(message)
        executor.spin_once(timeout_sec=0.1)
    assert (frame.image == picture).all() and frame.stamp_ns == 10**9
    source._take(CompressedImage(header=message.header, data=message.data[:-3]), 0)
    with pytest.raises(BadFrame, match='left/image_raw/compressed: .* cut'):
        while True:
            source.read()
    source.close()
    executor.shutdown()


def test_a_topic_without_a_name_is_refused(node):
    with pytest.raises(BadArgument, match='topic'):
        TopicSource(node, '')

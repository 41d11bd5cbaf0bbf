# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Random images to the drivers' topic source give frames or BadFrame, and the next good image is read unchanged."""
import random

import pytest
import rclpy
from fed_nodes import at, compressed, messages, stamp_of
from random_messages import hostile
from tactile_driver.errors import BadFrame
from tactile_driver.nodes.topic_source import TopicSource


@pytest.mark.parametrize('count', [300, pytest.param(20_000, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_random_images_are_frames_or_refused(count):
    node, rng = rclpy.create_node('taker'), random.Random(4)
    source = TopicSource(node, 'camera/image_raw')
    images = [message for topic, message in messages('touchpad') if topic == 'image_raw']
    packed = [compressed(image, kind) for image in images for kind in ('.png', '.jpg')]
    stamp, bad = stamp_of(images[-1]), 0
    try:
        for number in range(count):
            stamp += 10_000_000
            good = at(images[number % len(images)], stamp)
            for message in (hostile(rng, good), hostile(rng, at(packed[number % len(packed)], stamp)), good):
                source._take(message, 0)
                try:
                    frame = source.read()
                except BadFrame as error:
                    bad += 1
                    assert message is not good and 'camera/image_raw' in str(error) or 'not a valid time' in str(error)
                    continue
                assert frame.image.dtype == 'uint8' and frame.image.size and frame.encoding in ('bgr8', 'mono8')
            assert (frame.stamp_ns, frame.image.tobytes()) == (stamp, good.data.tobytes())
            assert source.describe()['lost'] >= 0
    finally:
        source.close()
        node.destroy_node()
    assert 0.6 * count < bad < 2 * count

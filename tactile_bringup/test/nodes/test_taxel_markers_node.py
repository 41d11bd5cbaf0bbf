# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_markers_node draws for those who look, and nothing for nobody."""
import numpy as np
import pytest

pytest.importorskip('rclpy')
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_perception.nodes.messages.conversions import RESULTS  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

from tactile_bringup.nodes.taxel_markers_node import TaxelMarkersNode  # noqa: E402

pytestmark = pytest.mark.ros


def test_markers_of_one_instant_for_somebody_and_the_array_for_all(bench):
    other, until = bench(TaxelMarkersNode)
    publishers = {topic: other.create_publisher(kind, topic, 10) for topic, kind in {'image_raw': Image, **RESULTS}.items()}
    places, drawn = [], []
    other.create_subscription(TFMessage, '/tf_static', places.append, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    assert until(lambda: places)
    assert places[0].transforms[0].child_frame_id == 'taxel_array_taxels'
    assert not any(publisher.get_subscription_count() for publisher in publishers.values())
    other.create_subscription(MarkerArray, 'markers', drawn.append, 10)
    assert until(lambda: all(publisher.get_subscription_count() for publisher in publishers.values()))
    header = header_of(7 * 10**9, 'taxel_array')
    publishers['image_raw'].publish(image_to_message(Frame(np.zeros((3, 4), np.uint8), 0, 'mono8'), '', header))
    for topic, kind in RESULTS.items():
        publishers[topic].publish(kind(header=header))
    assert until(lambda: drawn)
    assert drawn[0].markers[1].ns == 'plate' and drawn[0].markers[1].header.stamp.sec == 7


def test_the_annotated_image_is_drawn_for_those_who_look(bench):
    other, until = bench(TaxelMarkersNode)
    publishers = {topic: other.create_publisher(kind, topic, 10) for topic, kind in {'image_raw': Image, **RESULTS}.items()}
    drawn = []
    other.create_subscription(Image, 'image_annotated', drawn.append, 10)
    assert until(lambda: all(publisher.get_subscription_count() for publisher in publishers.values()))
    header = header_of(7 * 10**9, 'taxel_array')
    values = np.zeros((44, 44), np.uint8)
    values[10:20, 10:20] = 100
    publishers['image_raw'].publish(image_to_message(Frame(values, 0, 'mono8'), '', header))
    for topic, kind in RESULTS.items():
        publishers[topic].publish(kind(header=header))
    assert until(lambda: drawn)
    assert drawn[0].encoding == 'bgr8' and drawn[0].width >= 600 and drawn[0].header.stamp.sec == 7

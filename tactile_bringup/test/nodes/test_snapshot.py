# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The command snapshot, beside a node that publishes what three sensors would."""

import cv2
import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS is not sourced')

from geometry_msgs.msg import Point  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from std_msgs.msg import ColorRGBA, String  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

from tactile_bringup.nodes.snapshot import SnapshotNode, main  # noqa: E402

pytestmark = pytest.mark.ros
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BLUE = np.full((48, 64, 3), (250, 10, 10), np.uint8)


class Hand(Node):
    """thumb: a touchpad that shows a blue picture; little: an array with a red one; tip: a finger with another one."""

    def __init__(self, context):
        super().__init__('hand', context=context)
        self.sent = []
        self.describe('thumb', 'touchpad', BLUE)
        self.describe('little', 'taxel_array', BLUE[..., ::-1].copy())
        self.describe('tip', 'psd_finger', BLUE)
        self.create_timer(0.1, lambda: [publisher.publish(message) for publisher, message in self.sent])

    def describe(self, name, kind, picture):
        publisher = self.create_publisher(String, f'{name}/description', LATCHED)
        publisher.publish(String(data=f'sensor_type: {kind}\n'))
        skin = Marker(type=Marker.TRIANGLE_LIST, color=ColorRGBA(g=1.0, a=1.0), points=[Point(), Point(x=1.0), Point(y=1.0)])
        for topic, message_type, message in (('image_annotated', Image, image_of(picture, 'bgr8')),
                                             ('markers', MarkerArray, MarkerArray(markers=[skin]))):
            self.sent.append((self.create_publisher(message_type, f'{name}/{topic}', 10), message))


def image_of(array, encoding):
    return image_to_message(Frame(array, 0, encoding), '', header_of(0, 'pad'))


@pytest.fixture
def hand(beside):
    return beside(Hand)


def test_a_tile_for_each_sensor(hand, tmp_path, capsys):
    out = tmp_path / 'hand.png'
    assert main([str(out)]) == 0
    picture = cv2.imread(str(out))
    assert picture.shape == (2 * 392, 2 * 960, 3)  # in the order of the names: little, thumb, tip
    assert picture[212, 1200].tolist() == [250, 10, 10] and picture[212, 240].tolist() == [10, 10, 250]
    scenes = picture[32:392, 480:960], picture[32:392, 1440:]
    assert all(((part[..., 1] > 200) & (part[..., 0] == 0)).sum() > 5000 for part in scenes), 'the skin'
    (tmp_path / 'hand.yaml').write_text('sensors: [{name: thumb, type: touchpad}, {name: index, type: touchpad}]\n')
    assert main([str(out), '--hand', str(tmp_path / 'hand.yaml'), '--patience', '4']) == 1
    assert 'no message from index (description)' in capsys.readouterr().err


def test_what_cannot_be_done_is_told(capsys, tmp_path):
    assert main([str(tmp_path / 'hand.png'), '--patience', '0.3']) == 1
    assert 'no sensor was found' in capsys.readouterr().err and not (tmp_path / 'hand.png').exists()
    assert main(['x.png', '--hand', 'none.yaml']) == 1


@pytest.mark.parametrize('text', ['- [', '2020-99-99', '!!python/object:os.system', '7', '[]', '\x01'])
def test_a_description_that_is_none_is_let_go(text):
    rclpy.init()
    node = SnapshotNode(['other'])
    try:
        node._take_description('other', String(data=text))
        assert node.seen['other'].type == ''
        node._take_description('other', String(data='sensor_type: psd_finger'))
        assert node.seen['other'].type == 'psd_finger'
    finally:
        node.destroy_node()
        rclpy.try_shutdown()

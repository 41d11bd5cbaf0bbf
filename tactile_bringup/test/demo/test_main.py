# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
import rclpy
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from tactile_bringup.demo import main
from tactile_driver.errors import BadArgument
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message
from tactile_msgs.msg import DotTracks


@pytest.fixture
def demo(tmp_path):
    """Makes a DemoNode in a domain of its own."""
    def make(**values):
        given = [f'{name}:={value}' for name, value in {'out': tmp_path / 'pictures', **values}.items()]
        rclpy.init(args=['--ros-args', *(word for text in given for word in ('-p', text))])
        return main.DemoNode()
    yield make
    rclpy.try_shutdown()


def feed(node, frames):
    for k in range(frames):
        header = Header(frame_id='pad')
        header.stamp.sec, header.stamp.nanosec = 100, 40_000_000 * k
        dots = DotTracks(header=header, rows=1, columns=2, id=[0, 1], u=[10.0, 20.0], v=[5.0, 5.0],
                         area=[float('nan')] * 2, du=[3.0, 0.0], dv=[4.0, 0.0])
        picture: Image = image_to_message(Frame(np.zeros((48, 64, 3), np.uint8), 0, 'bgr8'), 'bgr8', header)
        node._on_message('dots', dots)
        node._on_message('image_annotated', picture)


def test_it_writes_pictures_a_video_and_a_summary(demo, tmp_path, capsys):
    node = demo()
    node._expected = {'dots'}
    feed(node, 20)
    node.destroy_node()
    assert node.failed == ''
    names = {path.name for path in (tmp_path / 'pictures').iterdir()}
    assert 'largest_displacement.png' in names and any(name.startswith('demo.') for name in names)
    assert 'largest displacement 5.0 px' in capsys.readouterr().out


def test_where_nothing_came_it_says_why(demo, capsys):
    node = demo(patience=0.1)
    node._begin_s -= 1.0
    with pytest.raises(KeyboardInterrupt):
        node._look()
    node.destroy_node()
    assert 'no frame in 1 s' in node.failed and 'dots' in capsys.readouterr().err


def test_interrupted_before_anything_came_it_says_nothing(demo, capsys):
    node = demo()
    node.destroy_node()
    assert node.failed == '' and capsys.readouterr().err == ''


def test_a_folder_that_cannot_be_made_is_refused(demo):
    with pytest.raises(BadArgument, match='out'):
        demo(out='/proc/no/folder')


def test_a_message_that_fails_its_check_is_counted_and_skipped(demo, capsys):
    node = demo()
    node._expected = {'dots'}
    header = Header(frame_id='pad')
    node._on_message('dots', DotTracks(header=header, rows=1, columns=2, id=[0, 1], u=[10.0], v=[5.0], du=[3.0], dv=[4.0]))
    node._on_message('dots', DotTracks(header=header))
    node._on_message('image_annotated', Image(header=header, encoding='bgr8', height=4, width=4, step=1))
    feed(node, 5)
    node.destroy_node()
    assert node._summary.frames == 6 and 'refused messages: 2' in capsys.readouterr().out

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where a hand's sensors are mounted, as listeners that come later get it."""
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from tactile_bringup.nodes.hand_frames_node import HandFramesNode
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.host import Host

HAND = 'sensors:\n  - {name: left/thumb, type: touchpad, parent: palm, xyz: [0.1, 0.2, 0.3], quaternion: [0, 0.6, 0, 0.8]}\n' \
       '  - {name: index, type: psd_finger}\n'


def test_mountings_are_latched_under_the_names_of_the_file(bench, tmp_path):
    (tmp_path / 'hand.yaml').write_text(HAND)
    other, until = bench(lambda: HandFramesNode(Host(parameters={'hand': f'{tmp_path}/hand.yaml'})))
    found, reports = [], []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    other.create_subscription(TFMessage, '/tf_static', found.append, latched)
    other.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    assert until(lambda: found)
    thumb, index = found[0].transforms
    assert (thumb.header.frame_id, thumb.child_frame_id) == ('palm', 'left_thumb')
    assert (index.header.frame_id, index.child_frame_id) == ('hand', 'index')
    place, turned = thumb.transform.translation, thumb.transform.rotation
    assert (place.x, place.y, place.z) == (0.1, 0.2, 0.3) and (turned.x, turned.y, turned.z, turned.w) == (0.0, 0.6, 0.0, 0.8)
    assert until(lambda: any(s.message == '2 sensors on hand' for m in reports for s in m.status))


def test_without_a_file_it_says_what_is_missing():
    rclpy.init()
    try:
        with pytest.raises(BadArgument, match='hand'):
            HandFramesNode()
    finally:
        rclpy.try_shutdown()

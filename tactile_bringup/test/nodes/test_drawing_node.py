# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What nodes that draw share: who looks is heard of, places stand on /tf_static, bad parameters are named."""
import time

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Header
from tactile_bringup.nodes.drawing_node import DrawingNode
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.runtime.defect_guard import DefectGuard
from tactile_driver.parameters.table import Parameter
from tactile_msgs.msg import Slip
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray


class Lookers(DrawingNode):
    """Notes how many look; draws a marker, and takes it away."""

    def __init__(self):
        super().__init__('lookers', (Parameter('frame_id', str, 'pad', '', 'sensor frame'),))
        self.looking, self.markers = [], self

    def nothing(self, header):
        return MarkerArray(markers=[Marker(header=header, action=Marker.DELETEALL)])

    def draw(self):
        self.publish_drawn(self.marker_output, Header(frame_id='pad'), lambda: MarkerArray(markers=[Marker(ns='dots')]))

    def follow_demand(self):
        self.looking.append(self.marker_output.get_subscription_count())


def test_those_who_look_are_heard_of_and_a_place_is_latched(bench):
    made = []
    other, until = bench(lambda: made.append(Lookers()) or made[0])
    node = made[0]
    node.publish_place('tip', (0.0, 0.0, 0.016))
    places = []
    other.create_subscription(TFMessage, '/tf_static', places.append, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    assert until(lambda: places)
    place = places[0].transforms[0]
    assert (place.header.frame_id, place.child_frame_id) == ('pad', 'pad_tip')
    assert place.transform.translation.z == 0.016 and place.transform.rotation.w == 1.0
    look = other.create_subscription(MarkerArray, 'markers', lambda _message: None, 10)
    assert until(lambda: node.looking[-1:] == [1])
    other.destroy_subscription(look)
    assert until(lambda: node.looking[-1:] == [0])


def test_markers_go_when_nothing_new_has_come_for_two_seconds_and_when_the_node_ends(bench):
    made = []
    other, until = bench(lambda: made.append(Lookers()) or made[0])
    node, seen = made[0], []
    other.create_subscription(MarkerArray, 'markers', lambda message: seen.append((time.monotonic(), message.markers[0])), 10)
    assert until(lambda: node.looking[-1:] == [1])
    node.draw()
    assert until(lambda: len(seen) == 2)
    (drawn_s, _), (gone_s, gone) = seen
    assert gone.action == Marker.DELETEALL and gone.header.frame_id == 'pad' and 1.9 < gone_s - drawn_s
    until(lambda: False, 0.6)
    assert len(seen) == 2, 'once'
    node.draw()
    assert until(lambda: len(seen) == 3)
    node.destroy_node()
    node.destroy_node = lambda: None  # bench does it again
    assert until(lambda: len(seen) == 4) and seen[-1][1].action == Marker.DELETEALL


def test_what_the_nodes_of_the_sensor_warn_of_is_shown_without_data(bench):
    made = []
    other, until = bench(lambda: made.append(Lookers()) or made[0])
    node, seen = made[0], []
    node.warning = None
    other.create_subscription(MarkerArray, 'markers', seen.append, 10)
    reports = other.create_publisher(DiagnosticArray, '/diagnostics', 10)
    assert until(lambda: node.looking[-1:] == [1] and reports.get_subscription_count())

    def report(name, level, text):
        reports.publish(DiagnosticArray(status=[DiagnosticStatus(name=f'{name}: task', level=level, message=text)]))
    report('/thumb/dot_tracker_node', DiagnosticStatus.WARN, 'of another sensor')
    report('/dot_tracker_node', DiagnosticStatus.WARN, 'something presses; let go')
    assert until(lambda: node.warning == 'something presses; let go' and seen)
    report('/dot_tracker_node', DiagnosticStatus.OK, '30 Hz')
    assert until(lambda: node.warning == '')


def test_a_parameter_that_cannot_be_used_is_named():
    rclpy.init(args=['--ros-args', '-p', 'rate:=-1.0'])
    try:
        with pytest.raises(BadArgument, match='bad_drawer.*rate'):
            DrawingNode('bad_drawer', (Parameter('rate', float, 10.0, 'Hz', 'pictures', lowest=0.1),))
    finally:
        rclpy.try_shutdown()


def test_messages_that_cannot_be_drawn_are_counted_and_told_and_so_are_defects(monkeypatch):
    rclpy.init()
    node, done = Lookers(), []
    try:
        bad = Slip(state=9)
        node.try_message('slip', bad, lambda: done.append(bad))
        assert not done and node.log.refused == 1 and 'state 9 is none' in node.log.last_error
        monkeypatch.setattr(DefectGuard, 'strict', False)
        node.try_message('slip', Slip(), lambda: [][7])
        node.try_message('slip', Slip(), lambda: done.append(1))
        assert done == [1] and node.net.caught == 1 and node._examine().values['defects met'] == 1
        assert 'defect of this software' in node.log.last_error
    finally:
        node.markers = None
        node.destroy_node()
        rclpy.try_shutdown()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that draw, what they collect, and what they show."""

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point32, Polygon
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from tactile_bringup.nodes.drawing_node import DrawingNode, MarkersNode, StampSync
from tactile_bringup.visualization.constants import COLOURS
from tactile_bringup.visualization.pictures import bgr
from tactile_driver.errors import BadArgument
from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import image_to_message
from tactile_driver.nodes.runtime.defect_guard import DefectGuard
from tactile_driver.nodes.runtime.host import Host
from tactile_driver.parameters.table import Parameter
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.common.messages import points_to_message
from tactile_perception.common.surface_points import SurfacePoints

MS = 1_000_000


class Collected:
    def __init__(self, *expected):
        self.expected, self.sets = set(expected), []
        self.sync = StampSync(self.sets.append, lambda: self.expected)

    def add(self, topic, ms):
        self.sync.add(topic, ms * MS, f'{topic}{ms}')


def test_a_set_is_handed_over_when_it_is_complete():
    it = Collected('a', 'b')
    it.add('a', 1)
    assert it.sets == []
    it.add('b', 1)
    assert it.sets == [{'a': 'a1', 'b': 'b1'}]


def test_a_topic_that_has_a_publisher_and_is_silent_is_waited_for_two_seconds_and_again_from_its_next_message():
    it = Collected('dots', 'contacts')
    for k in range(15):
        it.add('dots', 200 * k)
    assert [found['dots'] for found in it.sets] == [f'dots{200 * k}' for k in range(10, 15)]
    it.sets.clear()
    it.add('contacts', 2800)
    it.add('dots', 3000)
    assert it.sets == []
    it.add('contacts', 3000)
    assert it.sets == [{'dots': 'dots3000', 'contacts': 'contacts3000'}]


def test_older_sets_are_let_go_and_late_messages_ignored():
    it = Collected('a', 'b')
    for topic, ms in (('a', 1), ('a', 2), ('b', 2), ('b', 1)):
        it.add(topic, ms)
    assert it.sets == [{'a': 'a2', 'b': 'b2'}]


def test_a_recording_that_begins_anew_is_followed():
    it = Collected('a', 'b')
    for ms in (5000, 5033, 100, 133):
        it.add('a', ms)
        it.add('b', ms)
    assert [s['a'] for s in it.sets] == ['a5000', 'a5033', 'a100', 'a133']


class Lookers(DrawingNode):
    """Notes how many look; shows an empty warning."""

    def __init__(self):
        super().__init__('lookers', (Parameter('frame_id', str, 'pad', '', 'sensor frame'),))
        self.looking, self.markers = [], self

    def alone(self, header):
        return MarkerArray(markers=[Marker(header=header)])

    def follow_demand(self):
        self.looking.append(self.marker_output.get_subscription_count())


def test_subscribers_are_noticed_and_the_frame_is_latched(bench):
    made = []
    other, until = bench(lambda: made.append(Lookers()) or made[0])
    node = made[0]
    node.publish_frame('tip', 0.016)
    positions = []
    other.create_subscription(TFMessage, '/tf_static', positions.append, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    assert until(lambda: positions)
    position = positions[0].transforms[0]
    assert (position.header.frame_id, position.child_frame_id) == ('pad', 'pad_tip')
    assert position.transform.translation.z == 0.016 and position.transform.rotation.w == 1.0
    look = other.create_subscription(MarkerArray, 'markers', lambda _message: None, 10)
    assert until(lambda: node.looking[-1:] == [1])
    other.destroy_subscription(look)
    assert until(lambda: node.looking[-1:] == [0])


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

    def warned():
        report('/thumb/dot_tracker_node', DiagnosticStatus.WARN, 'of another sensor')
        report('/dot_tracker_node', DiagnosticStatus.WARN, 'something presses; let go')
        return node.warning == 'something presses; let go' and seen
    assert until(warned)
    report('/dot_tracker_node', DiagnosticStatus.OK, '30 Hz')
    assert until(lambda: node.warning == '')


def test_a_parameter_that_cannot_be_used_is_named():
    rclpy.init(args=['--ros-args', '-p', 'rate:=-1.0'])
    try:
        with pytest.raises(BadArgument, match='bad_drawer.*rate'):
            DrawingNode('bad_drawer', (Parameter('rate', float, 10.0, 'Hz', 'pictures', lowest=0.1),))
    finally:
        rclpy.try_shutdown()


def test_messages_that_cannot_be_drawn_are_counted_and_reported_and_so_are_defects(monkeypatch):
    rclpy.init()
    node, done = Lookers(), []
    try:
        bad = Slip(state=9)
        node.try_message('slip', bad, lambda: done.append(bad))
        assert not done and node.log.refused == 1 and 'state 9 is not one of' in node.log.last_error
        monkeypatch.setattr(DefectGuard, 'strict', False)
        node.try_message('slip', Slip(), lambda: [][7])
        node.try_message('slip', Slip(), lambda: done.append(1))
        assert done == [1] and node.guard.caught == 1
        assert 'defect of this software' in node.log.last_error
    finally:
        node.markers = None
        node.destroy_node()
        rclpy.try_shutdown()


def sent_dots(stamp, nanosec=0):
    dots = DotTracks(rows=2, columns=2, id=[0, 1, 2, 3], u=[1.0, 2, 3, 4], v=[1.0, 2, 3, 4], du=[0.0] * 4, dv=[0.0] * 4, area=[9.0] * 4,
                     x=[0.001, 0.002, 0.001, 0.002], y=[0.001, 0.001, 0.002, 0.002], z=[0.013] * 4)
    dots.header.frame_id, dots.header.stamp.sec, dots.header.stamp.nanosec = 'pad', stamp, nanosec
    return dots


def test_nothing_is_subscribed_for_nobody_and_frames_are_drawn_for_somebody(bench):
    other, until = bench(MarkersNode)
    dots = other.create_publisher(DotTracks, 'dots', 10)
    region = other.create_publisher(ContactRegion, 'contact_region', 10)
    until(lambda: False, patience_s=1.0)
    assert dots.get_subscription_count() == 0
    seen = []
    other.create_subscription(MarkerArray, 'markers', seen.append, 10)
    assert until(lambda: dots.get_subscription_count() == 1 and region.get_subscription_count() == 1)
    stamp = 1
    while not seen and stamp < 60:
        stamp += 1
        message = sent_dots(stamp)
        dots.publish(message)
        region.publish(ContactRegion(header=message.header, dot_id=[0, 1, 2, 3], dot_state=[0, 1, 2, 0]))
        until(lambda: bool(seen), patience_s=1.0)
    assert seen and {m.header.frame_id for m in seen[0].markers} == {'pad'}
    assert {m.header.stamp.sec for m in seen[0].markers} <= set(range(2, stamp + 1))


def test_a_region_is_in_the_picture_by_the_positions_of_dots_in_a_plane():
    """10 px/mm, the origin at (100, 80), no calibrated camera."""
    uv = np.array([(u, v) for v in (40.0, 80.0, 120.0) for u in (60.0, 100.0, 140.0)])
    xyz, zeros = np.column_stack([1e-4 * (uv - (100.0, 80.0)), np.zeros(9)]), np.zeros((9, 3))
    square = Polygon(points=[Point32(x=x, y=y) for x, y in ((-0.002, -0.002), (0.002, -0.002), (0.002, 0.002), (-0.002, 0.002))])
    found = {'image_raw': image_to_message(Frame(np.full((480, 640), 100, np.uint8), 0, 'mono8'), '', Header()),
             'dots': DotTracks(id=range(9), u=uv[:, 0].tolist(), v=uv[:, 1].tolist(), du=[0.0] * 9, dv=[0.0] * 9, area=[9.0] * 9),
             'points': points_to_message(SurfacePoints((1, 9), xyz, zeros, zeros, zeros, np.zeros(9), np.zeros(9, np.uint8)), Header()),
             'contact_region': ContactRegion(outlines=[square], area=1.6e-5), 'contacts': Contacts()}
    rclpy.init()
    node = MarkersNode()
    try:
        shown = node.picture(found)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    row, column = np.nonzero((shown == bgr(COLOURS.region)).all(axis=2)[:200])
    assert (column.min(), column.max(), row.min(), row.max()) == pytest.approx((80, 120, 60, 100), abs=2)


@pytest.mark.full
def test_pictures_are_drawn_at_most_as_often_as_asked_for(bench):
    other, until = bench(lambda: MarkersNode(Host(parameters={'picture_rate': 15.0})))
    dots, images = other.create_publisher(DotTracks, 'dots', 10), other.create_publisher(Image, 'image_raw', 10)
    seen = []
    other.create_subscription(Image, 'image_annotated', lambda message: seen.append(message.header.stamp), 10)
    other.create_subscription(Image, 'image_raw', lambda _message: None, 10)  # as a tracker, which the node waits for
    assert until(lambda: dots.get_subscription_count() == 1 and images.get_subscription_count() == 2)
    for k in range(12):
        message = sent_dots(100, k * 33_333_333)
        dots.publish(message)
        images.publish(Image(header=message.header, encoding='mono8', height=48, width=64, step=64, data=bytes(48 * 64)))
        until(lambda: bool(seen) and seen[-1] == message.header.stamp, patience_s=0.5)
    assert until(lambda: len(seen) > 3)
    frames = [round(stamp.nanosec / 33_333_333) for stamp in seen]
    assert min(later - earlier for earlier, later in zip(frames, frames[1:])) == 2

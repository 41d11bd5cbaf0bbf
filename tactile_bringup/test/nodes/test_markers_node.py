# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""markers_node draws what belongs together, for those who look, and nothing for nobody."""
from geometry_msgs.msg import Point32, Polygon
from sensor_msgs.msg import Image
from tactile_bringup.nodes.markers_node import MarkersNode
from tactile_driver.nodes.runtime.host import Host
from tactile_msgs.msg import ContactRegion, DotTracks
from visualization_msgs.msg import MarkerArray


def sent_dots(stamp, nanosec=0):
    dots = DotTracks(rows=2, columns=2, id=[0, 1, 2, 3], u=[1.0, 2, 3, 4], v=[1.0, 2, 3, 4], du=[0.0] * 4, dv=[0.0] * 4, area=[9.0] * 4,
                     x=[0.001, 0.002, 0.001, 0.002], y=[0.001, 0.001, 0.002, 0.002], z=[0.013] * 4)
    dots.header.frame_id, dots.header.stamp.sec, dots.header.stamp.nanosec = 'pad', stamp, nanosec
    return dots


def test_nothing_is_subscribed_for_nobody_and_frames_are_drawn_for_somebody(bench):
    other, until = bench(MarkersNode)
    dots = other.create_publisher(DotTracks, 'dots', 10)
    region = other.create_publisher(ContactRegion, 'contact_region', 10)
    until(lambda: False, 1.0)
    assert dots.get_subscription_count() == 0
    seen = []
    other.create_subscription(MarkerArray, 'markers', seen.append, 10)
    assert until(lambda: dots.get_subscription_count() == 1 and region.get_subscription_count() == 1)
    stamp = 1
    while not seen and stamp < 20:
        stamp += 1
        message = sent_dots(stamp)
        dots.publish(message)
        region.publish(ContactRegion(header=message.header, dot_id=[0, 1, 2, 3], dot_state=[0, 1, 2, 0]))
        until(lambda: bool(seen), 1.0)
    assert seen and {m.header.frame_id for m in seen[0].markers} == {'pad'}
    assert {m.header.stamp.sec for m in seen[0].markers} <= set(range(2, stamp + 1))


def test_pictures_are_drawn_at_most_as_often_as_asked_for(bench):
    other, until = bench(lambda: MarkersNode(Host(parameters={'picture_rate': 15.0})))
    dots, images = other.create_publisher(DotTracks, 'dots', 10), other.create_publisher(Image, 'image_raw', 10)
    seen = []
    other.create_subscription(Image, 'image_annotated', lambda message: seen.append(message.header.stamp), 10)
    assert until(lambda: dots.get_subscription_count() == 1 and images.get_subscription_count() == 1, 30.0)
    for k in range(12):
        message = sent_dots(100, k * 33_333_333)
        dots.publish(message)
        images.publish(Image(header=message.header, encoding='mono8', height=48, width=64, step=64, data=bytes(48 * 64)))
        until(lambda: bool(seen) and seen[-1] == message.header.stamp, 0.5)
    frames = [round(stamp.nanosec / 33_333_333) for stamp in seen]
    assert len(frames) > 3 and set(later - earlier for earlier, later in zip(frames, frames[1:])) == {2}


def test_every_array_of_a_stream_with_gaps_is_complete(bench):
    other, until = bench(MarkersNode)
    outputs = {topic: other.create_publisher(kind, topic, 50) for topic, kind in (('dots', DotTracks), ('contact_region', ContactRegion))}
    seen = []
    other.create_subscription(MarkerArray, 'markers', seen.append, 50)
    assert until(lambda: all(output.get_subscription_count() for output in outputs.values()))
    until(lambda: False, 0.5)  # the node looks five times a second for who publishes
    outline = Polygon(points=[Point32(x=x, y=y) for x, y in ((0.001, 0.001), (0.002, 0.001), (0.001, 0.002))])
    complete = set()
    for k in range(1, 31):  # five sets a second, by their stamps
        dots = sent_dots(100)
        dots.header.stamp.sec, dots.header.stamp.nanosec = 100 + k // 5, 200_000_000 * (k % 5)
        sent = {'dots': dots, 'contact_region': ContactRegion(header=dots.header, outlines=[outline])}
        lost = {topic for topic, period in (('dots', 7), ('contact_region', 4)) if k % period == 3}
        for topic in sent.keys() - lost:
            outputs[topic].publish(sent[topic])
        if not lost:
            complete.add((dots.header.stamp.sec, dots.header.stamp.nanosec))
        until(lambda: False, 0.05)
    assert until(lambda: len(seen) >= len(complete))
    drawn = {(array.markers[0].header.stamp.sec, array.markers[0].header.stamp.nanosec) for array in seen}
    assert drawn == complete and all({'dots', 'outlines'} <= {marker.ns for marker in array.markers} for array in seen)

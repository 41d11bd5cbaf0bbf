# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The demo: numbers, moments, video, and the node."""

import math

import cv2
import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import Point32, Polygon, Vector3, WrenchStamped

from tactile_bringup.demo import DemoNode, Reading, Summary, Video, reading_of
from tactile_driver.errors import BadArgument
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip


def filled(count=91, rate=30.0):
    summary = Summary()
    for k in range(count):
        summary.add(Reading(k / rate, 0.01 + 1e-3 * k, values={'area': 1e-6 * k, 'depth': math.nan}))
    return summary


def test_rate_and_latency():
    assert filled(100).line(Reading(99 / 30, 0.0)) == '  3.3 s | 30 Hz, 64 ms', 'of the last 90'
    assert filled(100).report() == ['100 frames, 30.0 Hz, latency 60 ms (95 %: 104 ms)', 'largest area 99 mm2']
    one = Summary()
    one.add(Reading(5.0, math.nan))
    assert one.line(Reading(5.0, math.nan)) == '  0.0 s | - Hz, - ms' and one.report()[1] == 'largest values unknown'


def test_all_messages_of_a_touch():
    region = ContactRegion(dot_id=[1, 2, 3], dot_state=[0, 2, 2], area=4e-5, outlines=[Polygon(points=[Point32()] * 3)])
    wrench = WrenchStamped()
    wrench.wrench.force = Vector3(x=3.0, z=-4.0)
    found = {'dots': DotTracks(id=[1, 2, 3], du=[3.0, 0.0, float('nan')], dv=[4.0, 1.0, float('nan')]), 'contact_region': region,
             'contacts': Contacts(contacts=[Contact(depth=1e-3), Contact(depth=float('nan'))]), 'wrench': wrench,
             'slip': Slip(state=Slip.GROSS, slipping_fraction=0.75)}
    reading = reading_of(found, 5.0, 0.02)
    assert (reading.stamp_s, reading.latency_s, reading.values) == (5.0, 0.02, {'displacement': 5.0, 'area': 4e-5, 'depth': 1e-3})
    assert filled().line(reading).split(' | ')[1:-1] == [
        '3 dots, largest displacement 5.0 px', '40 mm2, 1.0 mm deep, 5.0 N, gross slip, 0 stick, 2 slip']
    free = reading_of({'contacts': Contacts(), 'slip': Slip(), 'contact_region': ContactRegion()}, 5.0, 0.02)
    assert free.words == ['nothing touches']
    without_region = reading_of({name: found[name] for name in ('contacts', 'slip')} | {'contact_region': ContactRegion()}, 5.0, 0.02)
    assert 'nothing touches' not in without_region.words and 'gross slip' in without_region.words[0]
    assert 'nan' not in filled().line(reading_of({'contacts': Contacts()}, 5.0, math.nan))


def test_the_best_frame_of_each_moment_is_kept():
    summary = Summary()
    for k, area in enumerate((0.0, 1e-5, 9e-5, 3e-5, 0.0)):
        summary.add_picture(Reading(float(k), 0.0, values={'area': area, 'depth': 1e-3 * (k == 3)}), np.full((2, 2, 3), k, np.uint8))
    found = summary.pictures()
    assert list(found) == ['first', 'largest_contact', 'deepest_contact', 'last']
    assert [stamp for stamp, _ in found.values()] == [0.0, 2.0, 3.0, 4.0] and found['deepest_contact'][1][0, 0, 0] == 3


def frames_of(path):
    capture, found = cv2.VideoCapture(str(path)), []
    while True:
        good, frame = capture.read()
        if not good:
            return capture.get(cv2.CAP_PROP_FPS), found
        found.append(int(frame.mean() + 0.5))


def test_it_plays_at_the_speed_of_the_stamps(tmp_path):
    it = Video(tmp_path / 'demo.mp4')
    for k in range(60):
        it.add(100.0 + k / 30, np.full((48, 64, 3), 4 * k, np.uint8))
    it.close()
    rate, found = frames_of(it.path)
    assert rate == pytest.approx(15.0)
    assert len(found) in (30, 31)
    assert np.abs(np.array(found) - 8 * np.arange(len(found))).max() <= 12  # a frame is 8


@pytest.fixture
def demo(tmp_path):
    """Makes a DemoNode in a domain of its own."""
    def make(**values):
        given = [f'{name}:={value}' for name, value in {'out': tmp_path / 'pictures', **values}.items()]
        rclpy.init(args=['--ros-args', *(word for text in given for word in ('-p', text))])
        return DemoNode()
    yield make
    rclpy.try_shutdown()


def test_interrupted_before_anything_came_it_says_nothing(demo, capsys):
    node = demo()
    node.destroy_node()
    assert node.failed == '' and capsys.readouterr().err == ''


def test_a_folder_that_cannot_be_made_is_refused(demo):
    with pytest.raises(BadArgument, match='out'):
        demo(out='/proc/no/folder')

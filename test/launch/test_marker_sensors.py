# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Launch files of the marker sheets and the cushion with a simulated sensor: contact points are estimated without any setup."""
import pathlib

import numpy as np
import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import WrenchStamped  # noqa: E402
from sensor_msgs.msg import Image, PointCloud2  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

pytestmark = pytest.mark.ros
RESULTS = {'dots': DotTracks, 'contacts': Contacts, 'contact_region': ContactRegion, 'wrench': WrenchStamped,
           'points': PointCloud2}
DRAWN = {'markers': MarkerArray, 'image_annotated': Image}
RAW = {'image_raw': Image, 'ground_truth/contacts': Contacts}
# sensor: its nodes, number of markers, largest error of a contact in m: position, depth
SENSORS = {'areal_single': ('camera_node', 117, 1e-3, 0.5e-3), 'areal_dual': ('dual_camera_node', 154, 1.5e-3, 0.3e-3),
           'air_cushion': ('camera_node', 221, 6e-3, 3e-3)}
NODES = ('dot_tracker_node', 'contact_point_node')
RATE = 10.0  # Hz


@pytest.fixture(params=SENSORS)
def sensor(request):
    return request.param


def numbers_of(point):
    return np.array([point.x, point.y, point.z])


def errors(told, true):
    """(place, depth) m of each frame in which one thing touches and one touch is told."""
    truth = {stamp: message.contacts for stamp, message in true.items() if len(message.contacts) == 1}
    pairs = [(message.contacts[0], truth[stamp][0]) for stamp, message in told.items() if stamp in truth and len(message.contacts) == 1]
    return np.array([(np.hypot(*(numbers_of(one.position) - numbers_of(other.position))[:2]), abs(one.depth - other.depth))
                     for one, other in pairs]).reshape(-1, 2)


def by_stamp(messages):
    return {message.header.stamp.sec * 10**9 + message.header.stamp.nanosec: message for message in list(messages)}


def check_touches(messages, truth, sensor):
    """Touched and untouched frames are told apart, and where and how deep the touch is."""
    _, _, place, depth = SENSORS[sensor]
    told, true = by_stamp(messages), by_stamp(truth)
    found = errors(told, true)
    assert len(found) > 3
    assert np.median(found[:, 0]) < place and np.median(found[:, 1]) < depth
    assert not [stamp for stamp, message in told.items() if message.contacts and stamp in true and not true[stamp].contacts]


def check_drawn(ear, sensor, count):
    """Markers coloured by depth, touches with the ellipsoid of their covariance; what RViz is set up to show is there."""
    drawn = [marker for message in list(ear.heard[f'/{sensor}/markers']) for marker in message.markers if marker.action == Marker.ADD]
    kinds = {marker.ns: marker for marker in drawn}
    assert {'dots', 'outlines', 'normals', 'covariances'} <= set(kinds)
    assert kinds['covariances'].type == Marker.SPHERE and 0 < kinds['covariances'].scale.x < 0.05
    if sensor != 'air_cushion':
        assert len(kinds['dots'].points) > 0.9 * count
        assert max(len({(c.r, c.g, c.b) for c in marker.colors}) for marker in drawn if marker.ns == 'dots') > 20
    graph = {name for name, _ in ear.node.get_topic_names_and_types()}
    file = pathlib.Path(get_package_share_directory('tactile_bringup')) / 'rviz' / f'{sensor}.rviz'
    shown = yaml.safe_load(file.read_text())['Visualization Manager']
    assert {d['Topic']['Value'] for d in shown['Displays'] if 'Topic' in d} <= graph
    assert shown['Global Options']['Fixed Frame'] == sensor


def check_health(ear, driver):
    """The last word of each node is that all is well."""
    levels = {status.name.split(':')[0].split('/')[-1]: (status.level, status.message)
              for message in list(ear.heard['/diagnostics']) for status in message.status}
    assert {driver, *NODES} <= set(levels)
    assert {name: said for name, said in levels.items() if said[0] != b'\0'} == {}


def heard_by(listen, sensor, topics, **more):
    return listen({**{f'/{sensor}/{topic}': kind for topic, kind in topics.items()}, **more})


def take_reference(ear, truth, sensor):
    """Have the tracker take the untouched state when nothing has touched for half a second: the middleware may have joined it to the camera
    so late that it began while something did."""
    client = ear.node.create_client(Trigger, f'/{sensor}/set_reference')
    assert client.wait_for_service(30)
    assert ear.wait_for(lambda: truth and truth[-1].contacts, 30)
    recent = int(RATE / 2)
    assert ear.wait_for(lambda: not any(message.contacts for message in truth[-recent:]), 30)
    answer = ear.ask(client, Trigger.Request())
    assert answer and answer.success
    ear.wait_for(lambda: False, 3 / RATE)


def run(ros2, listen, sensor, seconds, words):
    """Launch, listen from the first touch told for so many s, check, Ctrl-C."""
    driver, count, *_ = SENSORS[sensor]
    launched = ros2('launch', 'tactile_bringup', f'{sensor}.launch.py', f'rate:={RATE}', *words)
    ear = heard_by(listen, sensor, {**RESULTS, **DRAWN}, **{'/diagnostics': DiagnosticArray})
    dots, touched = (ear.heard[f'/{sensor}/{topic}'] for topic in ('dots', 'contacts'))
    # The scene begins with the first subscriber to images; this must be the tracker, which needs the untouched state.
    assert ear.wait_for(lambda: dots, 60), launched.log
    eye = heard_by(listen, sensor, RAW)
    take_reference(ear, eye.heard[f'/{sensor}/ground_truth/contacts'], sensor)
    touched.clear()
    assert ear.wait_for(lambda: any(message.contacts for message in list(touched)), 60), launched.log
    ear.wait_for(lambda: launched.process.poll() is not None, seconds)
    for topic, messages in {**ear.heard, **eye.heard}.items():
        assert messages, f'nothing on {topic}: {launched.log}'
    assert np.median([len(message.id) for message in list(dots)]) > 0.95 * count
    assert np.median(np.diff(ear.stamps(f'/{sensor}/contacts'))) * 1e-9 == pytest.approx(1 / RATE, rel=0.1)
    check_touches(touched, eye.heard[f'/{sensor}/ground_truth/contacts'], sensor)
    check_drawn(ear, sensor, count)
    check_health(ear, driver)
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []


def test_a_press_is_told_and_drawn(ros2, listen, sensor):
    run(ros2, listen, sensor, 5.0, [f'scene:={sensor}_press'])


@pytest.mark.slow
def test_a_minute_of_the_demo(ros2, listen, sensor):
    run(ros2, listen, sensor, 60.0, [])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors in Rerun: which topics are shown, and as which entities; the recording of a bag; the viewer's address and statistics."""
import json
import re
import subprocess
import urllib.request
from pathlib import Path

import cv2
import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Point32, Polygon, TransformStamped, Vector3, WrenchStamped
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image
from tf2_msgs.msg import TFMessage
from waiting import until

from tactile_bringup import view
from tactile_bringup.launch import arguments, hand
from tactile_bringup.view import command
from tactile_bringup.view.topics import sensor_topics
from tactile_driver.recordings.reader import RawMessage
from tactile_driver.recordings.serialization import encode, type_name_of
from tactile_driver.recordings.writer import BagWriter
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, PsdVoltages, Slip

EXTRAS = Path(__file__).parents[3] / 'environment' / 'extras.txt'
TOPICS = {'/thumb/image_raw': 'sensor_msgs/msg/Image', '/thumb/contacts': 'tactile_msgs/msg/Contacts',
          '/thumb/description': 'std_msgs/msg/String', '/thumb/ground_truth/contacts': 'tactile_msgs/msg/Contacts',
          '/eye/image_raw': 'sensor_msgs/msg/Image', '/tip/voltages': 'tactile_msgs/msg/PsdVoltages',
          '/hand/contacts': 'tactile_msgs/msg/HandContacts', '/tf': 'tf2_msgs/msg/TFMessage'}


def test_sensors_are_the_namespaces_with_tactile_messages():
    assert sensor_topics(TOPICS) == {'/thumb': {name: TOPICS[name] for name in ('/thumb/contacts', '/thumb/image_raw')},
                                     '/tip': {'/tip/voltages': 'tactile_msgs/msg/PsdVoltages'}}


@pytest.mark.parametrize('values, words', [({'view': 'true', 'web': 'false'}, ['--namespace', 'thumb']),
                                           ({'view': 'false', 'web': 'true'}, ['--namespace', 'thumb', '--web'])])
def test_launch_starts_it_in_a_window_or_for_a_browser(monkeypatch, values, words):
    monkeypatch.setattr(arguments, 'MISSING', '')
    node, = arguments.rerun_view(values, 'thumb')
    assert node.node_executable == 'view' and [''.join(part.text for part in word) for word in node.cmd[1:len(words) + 1]] == words
    assert arguments.rerun_view({'view': 'false', 'web': 'false'}) == []


def test_where_rerun_is_missing_everything_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr(arguments, 'MISSING', 'install it')
    note, = arguments.rerun_view({'view': 'true', 'web': 'false'})
    assert ''.join(part.text for part in note.msg).startswith('install it')
    monkeypatch.setattr(command, 'MISSING', 'install it')
    assert command.main([]) == 1 and capsys.readouterr().err == 'view: install it\n'


def test_every_launch_file_with_sensors_has_the_arguments():
    from tactile_bringup.launch.demo import demo_description
    from tactile_bringup.launch.grasp import grasp_arguments
    declared = {each.name for each in demo_description().entities if hasattr(each, 'name')}
    for names in (arguments.sensor_arguments('gel'), hand.hand_arguments(), grasp_arguments(), declared):
        assert {'view', 'web'} <= set(names)


def test_the_command_names_the_version_of_the_list_of_extras():
    wanted = re.search(r'^rerun-sdk==\S+(?=;)', EXTRAS.read_text(), re.MULTILINE)[0]
    assert wanted in Path(view.__file__).read_text()


# ---- with Rerun

NAN = float('nan')


def stamped(message, second=1, frame='thumb'):
    message.header.stamp.sec, message.header.frame_id = second, frame
    return message


def raw(topic, message, received_s=1.25):
    return RawMessage(topic, type_name_of(type(message)), int(1e9 * received_s), serialize_message(message))


class Stream:
    """Keeps what is logged."""

    def __init__(self):
        self.time, self.logged = None, {}

    def set_time(self, _timeline, timestamp):
        self.time = timestamp

    def log(self, path, what, static=False):
        self.logged.setdefault(path, []).append((None if static else self.time, what))

    def last(self, path):
        return self.logged[path][-1][1]


@pytest.fixture
def shown():
    pytest.importorskip('rerun', reason='Rerun, an optional extra, is not installed: environment/extras.txt')
    from tactile_bringup.view.entities import Entities
    found = Entities(Stream(), 0.0)
    found.stream = found._stream
    return found


def numbers(batch):
    return np.array(batch.as_arrow_array().to_pylist())


def test_contacts_are_points_normals_ellipsoids_and_numbers(shown):
    one = Contact(id=4, position=Point(x=0.001, z=0.012), normal=Vector3(z=1.0), depth=0.002, force=0.5,
                  position_covariance=np.diag([1e-8, 4e-8, 9e-8]).ravel().tolist())
    other = Contact(id=5, position=Point(x=0.01, z=0.012), normal=Vector3(z=1.0), depth=0.001, force=NAN, position_covariance=[NAN] * 9)
    shown.add(raw('/thumb/contacts', stamped(Contacts(contacts=[one, other]))))
    log = shown.stream
    assert numbers(log.last('/thumb/depth').scalars) == [2.0] and np.isnan(numbers(log.last('/thumb/force').scalars)).all()
    assert numbers(log.last('/thumb/latency').scalars) == pytest.approx(250.0)
    assert np.allclose(numbers(log.last('/thumb/contacts').positions), [[0.001, 0, 0.012], [0.01, 0, 0.012]])
    assert log.last('/thumb/contacts').labels.as_arrow_array().to_pylist() == ['2.0 mm, 0.50 N', '1.0 mm, - N']
    halves = numbers(log.last('/thumb/contacts/covariance').half_sizes)
    assert np.allclose(np.sort(halves[0]), 2.796 * np.array([1e-4, 2e-4, 3e-4]), rtol=1e-3) and len(halves) == 1
    assert log.logged['/thumb/contacts'][0][1].frame.as_arrow_array().to_pylist() == ['thumb']
    shown.add(raw('/thumb/contacts', stamped(Contacts(), 2)))
    assert numbers(log.last('/thumb/depth').scalars) == [0.0] and len(log.last('/thumb/contacts').positions) == 0


@pytest.mark.parametrize('region_first', [True, False])
def test_dots_have_the_colours_of_their_states_whichever_message_comes_first(shown, region_first):
    from tactile_bringup.visualization.constants import COLOURS
    shown.topics |= {'/thumb/dots', '/thumb/contact_region'}
    dots = raw('/thumb/dots', stamped(DotTracks(id=[4, 7, 9], u=[1.0, 2.0, 3.0], v=[4.0, 5.0, 6.0], x=[0.0] * 3,
                                              y=[0.0] * 3, z=[0.01] * 3)))
    square = Polygon(points=[Point32(x=x, y=y) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))])
    region = raw('/thumb/contact_region', stamped(ContactRegion(dot_id=[4, 7], dot_state=[1, 2], outlines=[square])))
    for message in (region, dots) if region_first else (dots, region):
        shown.add(message)
    packed = numbers(shown.stream.last('/thumb/image_raw/dots').colors)
    wanted = [int.from_bytes([int(255 * part) for part in colour] + [255], 'big') for colour in (*COLOURS.states[1:], (1, 1, 1))]
    assert packed.tolist() == wanted and numbers(shown.stream.last('/thumb/image_raw/dots').positions).tolist() == [[1, 4], [2, 5], [3, 6]]
    assert len(shown.stream.last('/thumb/dots').positions) == 3  # no cloud of points comes
    ring = shown.stream.last('/thumb/contact_region').strips.as_arrow_array().to_pylist()[0]
    assert len(ring) == 4 and ring[0] == ring[-1]


def test_an_array_is_coloured_and_a_camera_is_compressed(shown):
    shown.add(raw('/mat/image_raw', stamped(Image(height=2, width=2, encoding='mono8', step=2, data=[0, 0, 0, 200]))))
    pixels = numbers(shown.stream.last('/mat/image_raw').buffer).reshape(2, 2, 3)
    assert (pixels[0, 0] == pixels[0, 1]).all() and (pixels[1, 1] != pixels[0, 0]).any()
    shown.add(raw('/pad/image_raw', stamped(Image(height=200, width=200, encoding='mono8', step=200, data=bytes(40000)))))
    assert shown.stream.last('/pad/image_raw').media_type.as_arrow_array().to_pylist() == ['image/jpeg']


def test_forces_slip_voltages_frames_and_faults(shown):
    wrench = stamped(WrenchStamped())
    wrench.wrench.force, wrench.wrench.torque = Vector3(x=0.5, z=-2.0), Vector3(x=NAN, y=NAN, z=NAN)
    shown.add(raw('/thumb/wrench', wrench))
    assert numbers(shown.stream.last('/thumb/wrench/force').scalars).tolist() == [0.5, 0.0, -2.0]
    arrow = numbers(shown.stream.last('/thumb/wrench/arrow').vectors)[0]
    assert arrow[2] / arrow[0] == pytest.approx(-4.0) and np.linalg.norm(arrow) == pytest.approx(0.02)
    shown.add(raw('/thumb/slip', stamped(Slip(state=Slip.GROSS, slipping_fraction=0.5, x=[0.0, 0.0], y=[0.0, 0.0], vx=[0.1, NAN],
                                              vy=[0.0, NAN]))))
    assert numbers(shown.stream.last('/thumb/slip/fraction').scalars) == [0.5]
    assert numbers(shown.stream.last('/thumb/slip/state').scalars) == [2]
    assert len(shown.stream.last('/thumb/slip').vectors) == 1
    shown.add(raw('/tip/voltages', stamped(PsdVoltages(voltages=[1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0]))))
    assert numbers(shown.stream.last('/tip/voltages').scalars).tolist() == [2.0, 2.0, 2.0, 2.0]
    shown.add(raw('/tf_static', TFMessage(transforms=[stamped(TransformStamped(child_frame_id='thumb'), frame='palm')])))
    (at, placed), = shown.stream.logged['/tf/thumb']
    assert at is None and placed.parent_frame.as_arrow_array().to_pylist() == ['palm']
    fault = DiagnosticArray(status=[DiagnosticStatus(level=b'\x02', name='/thumb/camera_node', message='no camera')])
    shown.add(raw('/diagnostics', fault))
    shown.add(raw('/diagnostics', fault))
    assert len(shown.stream.logged['/diagnostics']) == 1


def test_surfaces_are_thinned_out_and_numbers_are_not(shown):
    from tactile_bringup.view.entities import Entities
    thin = Entities(shown.stream, 0.5)  # a picture in 2 s
    for second in range(8):
        thin.add(raw('/thumb/contacts', stamped(Contacts(), second)))
        thin.add(raw('/mat/image_raw', stamped(Image(height=2, width=2, encoding='mono8', step=2, data=[1] * 4), second)))
    logged = shown.stream.logged
    assert len(logged['/thumb/depth']) == 8 and len(logged['/mat/image_raw']) == 4
    assert len([at for at, _ in logged['/thumb/contacts'] if at is not None]) == 4


def test_a_damaged_message_is_counted(shown):
    whole = raw('/thumb/contacts', stamped(Contacts(contacts=[Contact()])))
    shown.add(whole._replace(data=whole.data[:40]))
    assert shown.refused == 1 and '/thumb/depth' not in shown.stream.logged


def test_views_are_those_of_the_topics_that_a_sensor_has(shown):
    from tactile_bringup.view.layout import blueprint, line_styles
    sensors = sensor_topics(TOPICS)
    assert set(line_styles(sensors)) == {'/thumb/force', '/thumb/depth', '/thumb/latency', '/tip/voltages'}
    views = []

    def walk(part):
        views.extend([part] if not getattr(part, 'contents', None) or isinstance(part.contents, str) else [])
        for each in part.contents if not isinstance(part.contents, str) else ():
            walk(each) if hasattr(each, 'contents') else None
            views.extend([each] if hasattr(each, 'class_identifier') else [])
    walk(blueprint(sensors, 'hand').root_container)
    names = {str(each.name) for each in views if each.name is not None}
    assert {'hand', '/thumb/image_raw', 'force, N', 'voltages, V', 'diagnostics'} <= names and 'slip' not in names


def test_a_bag_becomes_a_recording_of_rerun(shown, tmp_path, monkeypatch):
    with BagWriter(tmp_path / 'bag') as writer:
        for second in range(3):
            kind, data = encode(stamped(Contacts(contacts=[Contact(depth=0.001)]), second))
            writer.write('/thumb/contacts', kind, second * 10**9, data)
    assert command.main([str(tmp_path / 'bag'), '--save', str(tmp_path / 'x.rrd')]) == 0
    report = subprocess.run(['rerun', 'rrd', 'stats', tmp_path / 'x.rrd'], capture_output=True, text=True, check=True).stdout
    assert {'/thumb/contacts:', '/thumb/depth:', '/thumb/contacts/covariance:'} <= set(report.split())
    assert command.main([str(tmp_path / 'bag'), '--namespace', 'toe', '--save', str(tmp_path / 'y.rrd')]) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ['bag', 'x.rrd']


def test_raw_data_and_results_of_the_same_name_are_shown_together(shown, tmp_path):
    for folder, topic in (('raw', '/thumb/contacts'), ('results', '/thumb/slip')):
        with BagWriter(tmp_path / folder / 'thumb') as writer:
            kind, data = encode(stamped(Contacts(contacts=[Contact(depth=0.001)]) if folder == 'raw' else Slip(), 1))
            writer.write(topic, kind, 10**9, data)
    assert command.main([str(tmp_path / 'raw'), str(tmp_path / 'results' / 'thumb'), '--save', str(tmp_path / 'x.rrd')]) == 0
    report = subprocess.run(['rerun', 'rrd', 'stats', tmp_path / 'x.rrd'], capture_output=True, text=True, check=True).stdout
    assert '/thumb/contacts:' in report and '/thumb/slip' in report


def answers(address):
    try:
        return urllib.request.urlopen(address).status == 200
    except OSError:
        return False


def test_the_viewer_listens_here_alone_and_sends_no_statistics(shown, tmp_path, capsys):
    import psutil

    from tactile_bringup.view.viewer import Viewer, without_statistics
    with Viewer(web=True, address='127.0.0.1') as viewer:
        viewer.stream.flush()
        address = re.search(r'open (http://localhost:\d+/)', capsys.readouterr().out)[1]
        assert until(lambda: answers(address))
        with urllib.request.urlopen(address) as page:
            text = page.read().decode()
        assert '<link' in text and not re.search(r'<link[^>]*https?://', text)
        assert "connect-src 'self'" in page.headers['Content-Security-Policy']
        process = psutil.Process(viewer._process.pid)
        listening = [each.laddr.ip for one in (process, *process.children(recursive=True)) for each in one.net_connections()
                     if each.status == psutil.CONN_LISTEN]
        assert len(listening) == 2 and set(listening) == {'127.0.0.1'}
        config = Path(process.environ()['XDG_CONFIG_HOME'], 'rerun', 'analytics.json')
        assert json.loads(config.read_text())['analytics_enabled'] is False
    assert not psutil.pid_exists(process.pid) and not config.exists()
    assert without_statistics(str(tmp_path)) == {'XDG_CONFIG_HOME': str(tmp_path)}


@pytest.fixture
def tracker():
    """(a running dot_tracker_node /pad/dot_tracker_node, another node, until(condition))."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    from tactile_perception.core.node import make_node
    rclpy.init(args=['--ros-args', '-r', '__ns:=/pad'])
    executor, nodes = SingleThreadedExecutor(), [make_node('dot_tracker_node'), rclpy.create_node('view')]
    for node in nodes:
        executor.add_node(node)
    yield *nodes, lambda condition: until(condition, executor=executor)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def test_what_is_set_is_drawn_and_written_and_the_tracker_takes_it(shown, tracker, tmp_path):
    from rclpy.parameter import Parameter

    from tactile_bringup.view.tuning import Tuning
    from tactile_perception.core.parameter_files import read_parameters
    from tactile_perception.dots.parameters import DOT_PARAMETERS
    node, viewer, until = tracker
    tuning, file, log = Tuning(shown.stream, tmp_path / 'tuned.yaml'), tmp_path / 'tuned.yaml', shown.stream
    tuning.follow(viewer)
    image = np.full((200, 300), 120, np.uint8)
    for k in range(24):
        cv2.circle(image, (30 + 40 * (k % 6), 30 + 40 * (k // 6)), 6, 20 if k < 18 else 220, -1)
    picture = raw('/pad/image_raw', stamped(Image(height=200, width=300, encoding='mono8', step=300, data=image.tobytes())))

    def drawn(path):
        tuning.take(picture)
        return len(log.last(f'/pad/image_raw/{path}').strips) if f'/pad/image_raw/{path}' in log.logged else None
    assert until(lambda: drawn('candidates') == 24) and drawn('mask') == 0  # polarity any: both
    assert not file.exists()
    wrong = node.set_parameters([Parameter('mask', value='1,2,3')])[0]
    assert not wrong.successful and 'three corners' in wrong.reason
    assert all(each.successful for each in node.set_parameters([Parameter('polarity', value='dark'),
                                                                Parameter('mask', value='10,10,200,10,200,190,10,190')]))
    assert until(lambda: file.exists() and drawn('mask') == 1) and drawn('candidates') == 18
    values = read_parameters(file, 'dot_tracker_node', DOT_PARAMETERS)
    assert (values['polarity'], values['detection'], values['mask']) == ('dark', 'auto', '10,10,200,10,200,190,10,190')
    assert not node.set_parameters([Parameter('numbering', value='sort')])[0].successful, 'read only'
    assert command.main(['x', '--tune', str(file)]) == 1

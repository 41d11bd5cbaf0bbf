# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The launch file of each sensor (that of areal_single: test_bags.py) with a simulated one: results, stamps, frames, accuracy, what RViz
shows, and shutdown."""
import pathlib

import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from visualization_msgs.msg import MarkerArray

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_msgs.msg import ContactRegion, Contacts, DotTracks, PsdVoltages, Slip

SPACE = 'left/pad'
DOTS = {'dots': DotTracks, 'contacts': Contacts, 'contact_region': ContactRegion, 'wrench': WrenchStamped, 'points': PointCloud2}
CAMERA = {'image_raw': Image, 'camera_info': CameraInfo}
DRAWN = {'markers': MarkerArray, 'image_annotated': Image}
# sensor: scene, rate (Hz), raw topics, results, their period (s), maximum median error of position (m; finger: normal, rad) and depth (m)
SENSORS = {
    'touchpad': ('sphere_press', 10, CAMERA, {**DOTS, 'slip': Slip}, 0.1, 1e-3, 4e-4),
    'areal_dual': ('areal_dual_press', 10, CAMERA, DOTS, 0.1, 1.5e-3, 3e-4),
    'air_cushion': ('air_cushion_press', 10, CAMERA, DOTS, 0.1, 6e-3, 3e-3),
    'psd_finger': ('grid', 1000, {'voltages': PsdVoltages}, {'contacts': Contacts}, 0.005, 0.026, 2e-3),
    'taxel_array': ('demo', 30, {'image_raw': Image}, {**{name: kind for name, kind in DOTS.items() if name != 'dots'}, 'slip': Slip},
                    1 / 30, 2e-3, np.inf)}
RVIZ_TYPES = {'rviz_default_plugins/Image': 'sensor_msgs/msg/Image', 'rviz_default_plugins/Camera': 'sensor_msgs/msg/Image',
              'rviz_default_plugins/MarkerArray': 'visualization_msgs/msg/MarkerArray',
              'rviz_default_plugins/PointCloud2': 'sensor_msgs/msg/PointCloud2'}


def topics(names):
    return {f'/{SPACE}/{name}': kind for name, kind in names.items()}


def frames_of(messages):
    """Frames that messages name; of markers those of each."""
    return {one.header.frame_id for message in messages for one in (message.markers if hasattr(message, 'markers') else [message])}


def check_rviz(sensor, graph):
    """What RViz is set up to show is there, as the type that its displays take."""
    file = pathlib.Path(get_package_share_directory('tactile_bringup')) / 'rviz' / f'{sensor}.rviz'
    shown = yaml.safe_load(file.read_text())['Visualization Manager']
    found = {d['Topic']['Value'].replace(f'/{sensor}/', f'/{SPACE}/'): RVIZ_TYPES[d['Class']] for d in shown['Displays'] if 'Topic' in d}
    assert f'/{SPACE}/markers' in found and {topic: graph.get(topic) for topic in found} == found
    assert shown['Global Options']['Fixed Frame'] == sensor and graph['/tf_static'] == 'tf2_msgs/msg/TFMessage'


def off(sensor, found, truth):
    """(position, depth) of frames in which one thing touches and one contact is found."""
    true = {stamp_ns_of(message.header): message.contacts for message in list(truth)}
    stamps, pairs = np.array(sorted(true)), []
    for message in found:
        last = np.searchsorted(stamps, stamp_ns_of(message.header), side='right') - 1
        there = true[stamps[last]] if last >= 0 else []
        if len(message.contacts) == len(there) == 1:
            pairs.append((message.contacts[0], there[0]))
    what = 'normal' if sensor == 'psd_finger' else 'position'
    return np.array([(np.hypot(getattr(a, what).x - getattr(b, what).x, getattr(a, what).y - getattr(b, what).y), abs(a.depth - b.depth))
                     for a, b in pairs]).reshape(-1, 2)


def check_idle(listen, launched):
    """Without a subscriber nothing is computed."""
    ear = listen({'/diagnostics': DiagnosticArray})

    def idle():
        said = {status.name: status.message for message in list(ear.heard['/diagnostics']) for status in message.status}
        return sum('idle' in text for text in said.values())
    assert ear.wait_for(lambda: idle() == 2, 120), launched.log
    assert ear.node.count_subscribers(f'/{SPACE}/image_raw') == 0
    ear.close()


@pytest.mark.parametrize('sensor', SENSORS)
def test_a_simulated_sensor_as_a_user_starts_it(ros2, listen, sensor):
    scene, rate, raw, results, period, position, depth = SENSORS[sensor]
    launched = ros2('launch', 'tactile_bringup', f'{sensor}.launch.py', f'namespace:={SPACE}', f'scene:={scene}', f'rate:={rate}')
    if sensor == 'touchpad':
        check_idle(listen, launched)
    # The scene begins with the first who takes the raw data; this must be perception, which needs the untouched state.
    ear = listen({**topics({'contacts': Contacts}), '/diagnostics': DiagnosticArray})
    contacts = ear.heard[f'/{SPACE}/contacts']
    assert ear.wait_for(lambda: contacts, 120), launched.log
    others = listen(topics({**{name: kind for name, kind in results.items() if name != 'contacts'}, **raw, **DRAWN,
                            'ground_truth/contacts': Contacts}))
    truth = others.heard[f'/{SPACE}/ground_truth/contacts']
    least = 150 if sensor == 'psd_finger' else 15

    def enough():
        begin = stamp_ns_of(truth[0].header) if truth else np.inf
        touched = sum(bool(one.contacts) for one in list(contacts) if stamp_ns_of(one.header) > begin)
        reporting = {status.name for message in list(ear.heard['/diagnostics']) for status in message.status}
        return all(others.heard.values()) and touched > least and len(reporting) >= 3
    assert ear.wait_for(enough, 120), launched.log
    heard = {**ear.heard, **others.heard}
    graph = {name: types[0] for name, types in ear.node.get_topic_names_and_types()}
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []
    check_rviz(sensor, graph)
    health = {status.name.split(':')[0]: (status.level, status.message)
              for message in list(heard['/diagnostics']) for status in message.status}
    errors = {name: said for name, (level, said) in health.items() if level > b'\1'}  # a warning may be of a busy machine
    assert len(health) >= 3 and errors == {}
    for topic, messages in heard.items():
        assert messages, f'nothing on {topic}: {launched.log}'
        if topic != '/diagnostics':
            camera = 'camera_info' in raw and topic.endswith(('image_raw', 'camera_info', 'image_annotated'))
            assert frames_of(list(messages)) <= {'left_pad_camera_optical' if camera else 'left_pad'}, topic
    for name in results:
        stamps = (ear if name == 'contacts' else others).stamps(f'/{SPACE}/{name}')
        assert stamps == sorted(set(stamps)), name
    periods = np.diff(ear.stamps(f'/{SPACE}/contacts')) * 1e-9 / period  # whole ones: a slow listener gets the newest result
    assert np.median(np.abs(periods - np.rint(periods))) < 0.2 and np.median(periods) > 0.5
    found = off(sensor, contacts, truth)
    assert len(found) > 3 and np.median(found[:, 0]) < position and not np.median(found[:, 1]) > depth


@pytest.mark.parametrize('sensor, words, named', [('touchpad', ('params:=broken.yaml',), 'broken.yaml'),
                                                  ('psd_finger', ('source:=file', 'path:=.'), 'source:=file')])
def test_a_wrong_argument_is_named_in_one_line(ros2, tmp_path, sensor, words, named):
    (tmp_path / 'broken.yaml').write_text('a: [1\n')
    launched = ros2('launch', 'tactile_bringup', f'{sensor}.launch.py', *words)
    assert launched.wait(120) != 0
    assert named in launched.log
    assert len(launched.log.splitlines()) == 3, launched.log  # two are launch's own, about its log file
    assert 'process started' not in launched.log and 'Traceback' not in launched.log

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What RViz makes of each configuration, computed from the files alone by RViz's and Qt's rules."""
import pathlib
import struct

import numpy as np
import pytest
import yaml

from tactile_bringup.hand.configurations import moved_file, rviz_configuration
from tactile_bringup.hand.description import Hand, HandSensor, read_hand

PACKAGE = pathlib.Path(__file__).resolve().parents[2]
FIELD_OF_VIEW = np.radians(45)  # vertical: RViz's
BARS = 40, 95  # px: beside the 3D view; menu, tools and status line above and below it, at the least
# half widths, m, and height over the frame's origin, m, as the papers and the hardware have them; of the dome, where its markers are
BOXES = {'touchpad': (0.0187, 0.0187, 0.013), 'areal_single': (0.030, 0.0225, 0.0), 'areal_dual': (0.0665, 0.0455, 0.0),
         'air_cushion': (0.118, 0.118, 0.120), 'psd_finger': (0.016, 0.016, 0.016), 'taxel_array': (0.022, 0.022, 0.0)}
ONE_CAMERA = {'touchpad', 'areal_single', 'air_cushion'}


def shipped(name):
    return yaml.safe_load((PACKAGE / 'rviz' / f'{name}.rviz').read_text())


def displays(page, kind):
    return [each for each in page['Visualization Manager']['Displays'] if each['Class'] == f'rviz_default_plugins/{kind}']


def docks(state):
    """Area -> (width, height), px, of what QMainWindow::saveState wrote, and name -> whether it is shown."""
    data = bytes.fromhex(state)
    version, number, marker, count = struct.unpack_from('>iiBi', data)
    assert (version, number, marker) == (255, 0, 0xfd)
    place, found, shown = 13, {}, {}

    def read(layout):
        nonlocal place
        values = struct.unpack_from('>' + layout, data, place)
        place += struct.calcsize('>' + layout)
        return values

    def items():
        nonlocal place
        kind, = read('B')
        assert kind in (0xfc, 0xfa)
        if kind == 0xfa:
            read('i')
        _, many = read('Bi')
        for _ in range(many):
            item, = read('B')
            if item == 0xfb:
                length, = read('i')
                name, place = data[place:place + length].decode('utf-16-be'), place + length
                shown[name] = bool(read('BIIII')[0])
            else:
                assert item == 0xfc
                read('IIII')
                items()
    for _ in range(count):
        area, width, height = read('iii')
        found[area] = width, height
        items()
    return found, shown


def in_window(page, points):
    """(N, 2) places of points (N, 3), m, in the 3D view; -1 to 1 is inside."""
    geometry, view = page['Window Geometry'], page['Visualization Manager']['Views']['Current']
    assert view['Class'] == 'rviz_default_plugins/Orbit'
    areas, _ = docks(geometry['QMainWindow State'])
    width = geometry['Width'] - BARS[0] - areas[0][0] - areas[1][0]
    yaw, pitch = view['Yaw'], view['Pitch']
    towards = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross([0.0, 0.0, 1.0], towards) / np.cos(pitch)
    place = np.array([view['Focal Point'][axis] for axis in 'XYZ']) + view['Distance'] * towards
    across, up, back = ((points - place) @ np.stack([right, np.cross(towards, right), towards]).T).T
    assert (back < -view['Near Clip Distance']).all()
    slope = np.tan(FIELD_OF_VIEW / 2)
    return np.column_stack([across / (-back * slope * width / (geometry['Height'] - BARS[1])), up / (-back * slope)])


def outline(half_x, half_y, height):
    """Points (N, 3), m: the corners of a plate, or the rim and the top of a dome."""
    if not height:
        return np.array([(x, y, 0.0) for x in (-half_x, half_x) for y in (-half_y, half_y)])
    turn = np.linspace(0, 2 * np.pi, 60)
    return np.vstack([np.column_stack([half_x * np.cos(turn), half_y * np.sin(turn), 0 * turn]), (0.0, 0.0, height)])


@pytest.fixture(params=BOXES)
def sensor(request):
    return request.param


def test_the_sensor_fills_the_picture_and_its_longest_arrow_is_in_it(sensor):
    values = {}
    for section in yaml.safe_load((PACKAGE / 'params' / f'{sensor}.yaml').read_text()).values():
        values.update(section['ros__parameters'])
    reach = values['normal_length'] + values.get('force_length', 0.0)
    seen = in_window(shipped(sensor), outline(*BOXES[sensor]))
    assert np.abs(seen).max() < 1.0 and np.ptp(seen, axis=0).max() > 2 * 0.7
    top = (0.0, 0.0, BOXES[sensor][2] + reach)
    assert np.abs(in_window(shipped(sensor), np.array([top]))).max() < 1.0


def test_topics_and_frame_are_those_of_the_sensor(sensor):
    page = shipped(sensor)
    assert page['Visualization Manager']['Global Options']['Fixed Frame'] == sensor
    topics = {(each['Class'].split('/')[1], each['Topic']['Value'].removeprefix(f'/{sensor}/'), each['Enabled'])
              for each in page['Visualization Manager']['Displays'] if 'Topic' in each}
    expected = {('MarkerArray', 'markers', True), ('Image', 'image_annotated', True)}
    if sensor != 'psd_finger':
        expected |= {('Image', 'image_raw', True), ('PointCloud2', 'points', False)}
    if sensor in ONE_CAMERA:
        expected.add(('Camera', 'image_raw', False))
    assert topics == expected
    assert all(each['Enabled'] == each['Value'] for each in page['Visualization Manager']['Displays'])


def test_another_namespace_takes_the_place_of_the_type(sensor):
    page = yaml.safe_load(moved_file(sensor, 'left/pad', 'left_pad'))
    assert page['Visualization Manager']['Global Options']['Fixed Frame'] == 'left_pad'
    topics = [each['Topic']['Value'] for each in page['Visualization Manager']['Displays'] if 'Topic' in each]
    assert topics and all(topic.startswith('/left/pad/') for topic in topics)
    assert page['Window Geometry'] == shipped(sensor)['Window Geometry']


def test_the_example_hand_fills_its_picture_and_has_a_dock_for_each_image():
    hand = read_hand(PACKAGE / 'hands' / 'example_hand.yaml')
    page = yaml.safe_load(rviz_configuration(hand))
    corners = np.vstack([turned(sensor, outline(*BOXES[sensor.type])) for sensor in hand.sensors])
    seen = in_window(page, corners)
    assert np.abs(seen).max() < 1.0 and np.ptp(seen, axis=0).max() > 2 * 0.7
    names = [f'{sensor.name}: annotated' for sensor in hand.sensors]
    assert [each['Name'] for each in displays(page, 'Image')] == names
    _, shown = docks(page['Window Geometry']['QMainWindow State'])
    assert all(shown[name] for name in names)


def turned(sensor, points):
    x, y, z, w = sensor.quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return points @ (np.eye(3) + 2 * w * cross + 2 * cross @ cross).T + sensor.xyz


def test_every_sensor_of_a_hand_has_its_markers_and_its_picture_in_the_frame_of_the_hand():
    hand = Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm', (0.1, 0.0, 0.0)),
                         HandSensor('tip', 'psd_finger', 'left_thumb', (-0.2, 0.0, 0.0))))
    manager = yaml.safe_load(rviz_configuration(hand))['Visualization Manager']
    shown = {each['Topic']['Value'] for each in manager['Displays'] if 'Topic' in each}
    assert shown == {'/left/thumb/markers', '/tip/markers', '/left/thumb/image_annotated', '/tip/image_annotated'}
    assert manager['Global Options']['Fixed Frame'] == 'palm'
    view = manager['Views']['Current']
    assert [view['Focal Point'][axis] for axis in 'XYZ'] == pytest.approx([0.0, 0.0, 0.01], abs=0.03), 'they hang on each other'

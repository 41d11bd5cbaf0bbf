# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What RViz shows of each configuration, computed from the files alone: all of the sensor and of its arrows, and the sensor large."""
import pathlib
import struct

import numpy as np
import pytest
import yaml

from tactile_bringup.hand.configurations import rviz_configuration
from tactile_bringup.hand.description import read_hand
from tactile_bringup.visualization.rviz import files as rviz_files

PACKAGE = pathlib.Path(__file__).resolve().parents[3]
FILES = rviz_files.rviz_files()
FIELD_OF_VIEW = np.radians(45)  # vertical: RViz's
BARS = 40, 95  # px: beside the 3D view; menu, tools and status line above and below it, at the least
# half widths, m, and height over the frame's origin, m, as the papers and the hardware have them
BOXES = {'touchpad': (0.0187, 0.0187, 0.013), 'areal_single': (0.030, 0.0225, 0.0), 'areal_dual': (0.0665, 0.0455, 0.0),
         'air_cushion': (0.150, 0.150, 0.120), 'psd_finger': (0.016, 0.016, 0.016), 'taxel_array': (0.022, 0.022, 0.0)}


def docks(state):
    """Area -> (width, height), px, of what QMainWindow::saveState wrote, and the names in it."""
    data = bytes.fromhex(state)
    version, number, marker, count = struct.unpack_from('>iiBi', data)
    assert (version, number, marker) == (255, 0, 0xfd)
    place, found, names = 13, {}, []

    def read(layout):
        nonlocal place
        values = struct.unpack_from('>' + layout, data, place)
        place += struct.calcsize('>' + layout)
        return values

    def items():
        kind, = read('B')
        assert kind in (0xfc, 0xfa)
        if kind == 0xfa:
            read('i')
        _, many = read('Bi')
        for _ in range(many):
            item, = read('B')
            if item == 0xfb:
                names.append(data[place + 4:place + 4 + read('i')[0]].decode('utf-16-be'))
                place_after_name()
                read('BIIII')
            else:
                assert item == 0xfc
                read('IIII')
                items()

    def place_after_name():
        nonlocal place
        place += 2 * len(names[-1])
    for _ in range(count):
        area, width, height = read('iii')
        found[area] = width, height
        items()
    return found, names


def camera(page):
    """Place (3,), m, and rows (3, 3): to the right, upwards, towards the camera."""
    view = page['Visualization Manager']['Views']['Current']
    assert view['Class'] == 'rviz_default_plugins/Orbit'
    yaw, pitch = view['Yaw'], view['Pitch']
    back = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    return np.array([view['Focal Point'][axis] for axis in 'XYZ']) + view['Distance'] * back, np.stack([right, np.cross(back, right), back])


def in_window(page, points):
    """(N, 2) places of points (N, 3), m, in the 3D view; -1 to 1 is inside."""
    geometry = page['Window Geometry']
    areas, _ = docks(geometry['QMainWindow State'])
    width = geometry['Width'] - BARS[0] - areas[0][0] - areas[1][0]
    place, axes = camera(page)
    across, up, back = ((points - place) @ axes.T).T
    assert (back < -page['Visualization Manager']['Views']['Current']['Near Clip Distance']).all()
    slope = np.tan(FIELD_OF_VIEW / 2)
    return np.column_stack([across / (-back * slope * width / (geometry['Height'] - BARS[1])), up / (-back * slope)])


def box(half_x, half_y, height):
    return np.array([(x, y, z) for x in (-half_x, half_x) for y in (-half_y, half_y) for z in (0.0, height)])


@pytest.fixture(params=BOXES)
def sensor(request):
    return request.param


def test_the_files_are_what_the_code_makes():
    # After a change: python3 -m tactile_bringup.visualization.rviz.files tactile_bringup/rviz
    shipped = {path.name: path.read_text() for path in (PACKAGE / 'rviz').glob('*.rviz')}
    assert shipped == FILES and set(FILES) == {f'{name}.rviz' for name in BOXES}


def test_all_of_the_sensor_is_in_the_picture_and_fills_it(sensor):
    seen = in_window(yaml.safe_load(FILES[f'{sensor}.rviz']), box(*BOXES[sensor]))
    assert np.abs(seen).max() < 0.95
    assert np.ptp(seen, axis=0).max() > 2 * 0.65, 'two thirds of the width or of the height'


def test_the_longest_arrow_on_the_sensor_is_in_the_picture(sensor):
    values = {}
    for section in yaml.safe_load((PACKAGE / 'params' / f'{sensor}.yaml').read_text()).values():
        values.update(section['ros__parameters'])
    reach = values['normal_length'] + values.get('force_length', 0.0)
    half_x, half_y, height = BOXES[sensor]
    ends = [(0.0, 0.0, height + reach)]
    if not height:
        ends += [(x, y, reach) for x in (-half_x, half_x) for y in (-half_y, half_y)]
    assert np.abs(in_window(yaml.safe_load(FILES[f'{sensor}.rviz']), np.array(ends))).max() < 0.95


def test_grid_and_frames_are_of_the_sensors_size(sensor):
    page = yaml.safe_load(FILES[f'{sensor}.rviz'])['Visualization Manager']['Displays']
    width = 2 * max(BOXES[sensor][:2])
    grid, frames = (next(d for d in page if d['Class'].endswith(kind)) for kind in ('/Grid', '/TF'))
    assert 1.0 < grid['Cell Size'] * grid['Plane Cell Count'] / width < 3.1
    assert 0.1 < 0.2 * frames['Marker Scale'] / width < 0.3, "an axis; RViz's are 0.2 m at a scale of 1"


def test_points_are_offered_and_not_shown(sensor):
    page = yaml.safe_load(FILES[f'{sensor}.rviz'])['Visualization Manager']['Displays']
    clouds = [d for d in page if d['Class'].endswith('/PointCloud2')]
    assert len(clouds) == (sensor != 'psd_finger')
    for cloud in clouds:
        assert cloud['Topic']['Value'] == f'/{sensor}/points' and cloud['Enabled'] is cloud['Value'] is False
        assert cloud['Channel Name'] == ('normal_force' if sensor in ('touchpad', 'taxel_array') else 'displacement_z')
        assert cloud['Min Intensity'] < cloud['Max Intensity'] and not cloud['Autocompute Intensity Bounds']


def test_pictures_have_large_panels_of_their_own_and_the_rest_is_folded(sensor):
    page = yaml.safe_load(FILES[f'{sensor}.rviz'])
    geometry = page['Window Geometry']
    pictures = [d['Name'] for d in page['Visualization Manager']['Displays'] if d['Class'].endswith('/Image')]
    areas, names = docks(geometry['QMainWindow State'])
    assert names == ['Displays', *pictures, 'Views', 'Time'], 'one below the other in this order'
    assert geometry['Views']['collapsed'] and geometry['Time']['collapsed']
    if pictures:
        assert areas[1][0] >= 560 and areas[1][1] / len(pictures) >= 420


def test_the_example_hand_fills_its_picture():
    hand = read_hand(PACKAGE / 'hands' / 'example_hand.yaml')
    page = yaml.safe_load(rviz_configuration(hand))
    corners = np.vstack([turned(sensor, box(*BOXES[sensor.type])) for sensor in hand.sensors])
    seen = in_window(page, corners)
    assert np.abs(seen).max() < 0.95 and np.ptp(seen, axis=0).max() > 2 * 0.75


def turned(sensor, points):
    x, y, z, w = sensor.quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return points @ (np.eye(3) + 2 * w * cross + 2 * cross @ cross).T + sensor.xyz

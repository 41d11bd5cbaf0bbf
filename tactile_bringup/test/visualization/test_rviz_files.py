# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The configurations of RViz."""
import pathlib

import pytest
import yaml

from tactile_bringup.hand.configurations import moved_file, rviz_configuration
from tactile_bringup.hand.description import Hand, HandSensor

PACKAGE = pathlib.Path(__file__).resolve().parents[2]
SENSORS = 'touchpad', 'areal_single', 'areal_dual', 'air_cushion', 'psd_finger', 'taxel_array'
ONE_CAMERA = {'touchpad', 'areal_single', 'air_cushion'}


def shipped(name):
    return yaml.safe_load((PACKAGE / 'rviz' / f'{name}.rviz').read_text())


@pytest.fixture(params=SENSORS)
def sensor(request):
    return request.param


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


def test_every_sensor_of_a_hand_has_its_markers_and_its_picture_in_the_frame_of_the_hand():
    hand = Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm', (0.1, 0.0, 0.0)),
                         HandSensor('tip', 'psd_finger', 'left_thumb', (-0.2, 0.0, 0.0))))
    manager = yaml.safe_load(rviz_configuration(hand))['Visualization Manager']
    shown = {each['Topic']['Value'] for each in manager['Displays'] if 'Topic' in each}
    assert shown == {'/left/thumb/markers', '/tip/markers', '/left/thumb/image_annotated', '/tip/image_annotated'}
    assert manager['Global Options']['Fixed Frame'] == 'palm'
    view = manager['Views']['Current']
    assert [view['Focal Point'][axis] for axis in 'XYZ'] == pytest.approx([0.0, 0.0, 0.01], abs=0.03), 'they hang on each other'

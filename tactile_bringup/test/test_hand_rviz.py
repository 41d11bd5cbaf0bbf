# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
import yaml

from tactile_bringup.hand_file import Hand, HandSensor
from tactile_bringup.hand_rviz import rviz_configuration

HAND = Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm', (0.1, 0.0, 0.0)),
                     HandSensor('tip', 'psd_finger', 'palm', (-0.1, 0.0, 0.0))))


def test_every_sensor_has_its_markers_and_each_camera_its_picture_in_the_frame_of_the_hand():
    page = yaml.safe_load(rviz_configuration(HAND))['Visualization Manager']
    shown = {d['Topic']['Value']: d['Class'] for d in page['Displays'] if 'Topic' in d}
    assert shown == {'/left/thumb/markers': 'rviz_default_plugins/MarkerArray', '/tip/markers': 'rviz_default_plugins/MarkerArray',
                     '/left/thumb/image_annotated': 'rviz_default_plugins/Image'}
    assert page['Global Options']['Fixed Frame'] == 'palm'
    view = page['Views']['Current']
    assert view['Focal Point'] == {'X': 0.0, 'Y': 0.0, 'Z': 0.0} and view['Distance'] == pytest.approx(0.35)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pathlib
from pathlib import Path

import pytest
import yaml
from tactile_bringup.hand.configurations import aggregator_configuration, main, rviz_configuration
from tactile_bringup.hand.description import Hand, HandSensor, read_hand


def test_one_analyzer_for_each_sensor_takes_its_nodes():
    page = yaml.safe_load(aggregator_configuration(Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm'),))))
    assert page == {'analyzers': {'ros__parameters': {'path': 'palm', 'left_thumb': {
        'type': 'diagnostic_aggregator/GenericAnalyzer', 'path': 'left/thumb', 'startswith': ['/left/thumb/']}}}}


HAND = Hand('palm', (HandSensor('left/thumb', 'touchpad', 'palm', (0.1, 0.0, 0.0)),
                     HandSensor('tip', 'psd_finger', 'left_thumb', (-0.2, 0.0, 0.0))))


def test_every_sensor_has_its_markers_and_its_picture_in_the_frame_of_the_hand():
    page = yaml.safe_load(rviz_configuration(HAND))['Visualization Manager']
    shown = {d['Topic']['Value']: d['Class'] for d in page['Displays'] if 'Topic' in d}
    assert shown == {'/left/thumb/markers': 'rviz_default_plugins/MarkerArray', '/tip/markers': 'rviz_default_plugins/MarkerArray',
                     '/left/thumb/image_annotated': 'rviz_default_plugins/Image',
                     '/tip/image_annotated': 'rviz_default_plugins/Image'}
    assert page['Global Options']['Fixed Frame'] == 'palm'
    frames = next(d for d in page['Displays'] if d['Class'].endswith('/TF'))['Frames']
    assert frames == {'All Enabled': True, 'left_thumb_camera_optical': {'Value': False}, 'tip_tip': {'Value': False}}


def test_the_view_is_towards_the_middle_of_sensors_that_hang_on_each_other():
    view = yaml.safe_load(rviz_configuration(HAND))['Visualization Manager']['Views']['Current']
    assert [view['Focal Point'][axis] for axis in 'XYZ'] == pytest.approx([0.0, 0.0, 0.01], abs=0.03)


def test_sensors_turned_away_take_other_room():
    turned = Hand('palm', (HandSensor('pad', 'touchpad', 'palm', quaternion=(1.0, 0.0, 0.0, 0.0)),))
    view = yaml.safe_load(rviz_configuration(turned))['Visualization Manager']['Views']['Current']
    assert view['Focal Point']['Z'] < 0


def test_a_parameter_file_of_its_own_tells_a_sensors_size(tmp_path):
    folder = pathlib.Path(__file__).parents[2] / 'params'
    page = yaml.safe_load((folder / 'taxel_array.yaml').read_text())
    page['/**']['ros__parameters'].update(rows=88, columns=88)
    (tmp_path / 'large.yaml').write_text(yaml.safe_dump(page))

    def distance(**settings):
        hand = Hand('palm', (HandSensor('pad', 'taxel_array', 'palm', settings=settings),))
        return yaml.safe_load(rviz_configuration(hand))['Visualization Manager']['Views']['Current']['Distance']
    assert distance(params=str(tmp_path / 'large.yaml')) > 1.6 * distance()


def test_the_example_has_a_panel_for_each_picture():
    hand = read_hand(pathlib.Path(__file__).parents[2] / 'hands' / 'example_hand.yaml')
    page = yaml.safe_load(rviz_configuration(hand))
    names = [d['Name'] for d in page['Visualization Manager']['Displays'] if d['Class'].endswith('/Image')]
    assert names == ['thumb: annotated', 'index: annotated', 'middle: annotated', 'little: annotated', 'palm: annotated']
    state = bytes.fromhex(page['Window Geometry']['QMainWindow State'])
    assert all(name.encode('utf-16-be') in state for name in names)


EXAMPLE = Path(__file__).parents[2] / 'hands' / 'example_hand.yaml'


def test_both_files_are_written_and_named(tmp_path, capsys):
    assert main([str(EXAMPLE), str(tmp_path / 'out')]) == 0
    written = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in written] == ['example_hand.rviz', 'example_hand_diagnostics.yaml']
    displays = yaml.safe_load(written[0].read_text())['Visualization Manager']['Displays']
    assert sum('markers' in d.get('Topic', {}).get('Value', '') for d in displays) == 5
    assert len(yaml.safe_load(written[1].read_text())['analyzers']['ros__parameters']) == 6


def test_a_file_that_is_no_hand_is_told(tmp_path, capsys):
    assert main([str(tmp_path / 'none.yaml'), str(tmp_path)]) == 1
    assert 'none.yaml: cannot be read' in capsys.readouterr().err

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A hand: its file and its configurations, and how it is launched."""
from pathlib import Path
from types import SimpleNamespace

from launch.actions import LogInfo
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tactile_bringup.hand.configurations import main
from tactile_bringup.hand.description import HandSensor, read_hand
from tactile_bringup.launch import arguments as processes, recorded
from tactile_bringup.launch.hand import hand_actions, hand_arguments, planned_sensor, sensor_values
from tactile_driver.errors import BadArgument
import yaml

GIVEN = {'hand': 'hand.yaml', 'source': 'sim', 'path': '', 'autostart': '', 'loop': '', 'stay': 'false', 'record': '',
         'composed': 'true'}


def actions(**given):
    return hand_actions({name: default for name, (default, _) in hand_arguments().items()} | given)


def notes(found):
    return [''.join(part.text for part in action.msg) for action in found if isinstance(action, LogInfo)]


def test_the_example_hand_is_a_process_for_each_sensor_and_one_for_the_frames(processes_of):
    found = actions()
    assert notes(found) == []
    assert [nodes[0] for nodes in processes_of(found)] == ['camera_node', 'camera_node', 'psd_node', 'taxel_array_node', 'dual_camera_node',
                                                           'hand_frames_node']
    alone = [node for nodes in processes_of(actions(composed='false')) for node in nodes]
    assert alone.count('camera_node') == 2 and alone[-1] == 'hand_frames_node' and len(alone) == 19


def test_a_simulated_hand_has_the_specimens_parameters_whatever_the_real_ones_are():
    own = {'calibration': '/mine.yaml', 'params': '/mine.yaml', 'device': '1', 'rate': '15'}
    sensor = HandSensor('palm', 'areal_dual', 'hand', settings=own)
    values = sensor_values(sensor, GIVEN)
    assert [values[name] for name in ('params', 'calibration', 'device', 'rate', 'namespace')] == ['', '', '', '15', 'palm']
    plan = planned_sensor(sensor, GIVEN)
    assert plan.params.endswith('params/areal_dual_sim.yaml')
    assert plan.nodes['contact_point_node']['calibration'].endswith('calibration/areal_dual_sim.yaml')
    real = sensor_values(sensor, {**GIVEN, 'source': 'device'})
    assert (real['calibration'], real['params'], real['device']) == ('/mine.yaml', '/mine.yaml', '1')


def test_a_recorded_sensor_plays_its_own_topics_with_the_parameters_of_what_was_recorded(monkeypatch):
    own = str(Path(__file__).parent)
    monkeypatch.setattr(recorded, 'bag_of', lambda recording, name: own)
    monkeypatch.setattr(recorded, 'recorded_topics', lambda path, kind, name, topics: (topics, name == 'palm'))
    given = {**GIVEN, 'source': 'bag', 'path': 'bag', 'loop': 'true'}
    palm = planned_sensor(HandSensor('palm', 'areal_dual', 'hand', settings={'rate': '60', 'params': '/mine.yaml'}), given)
    assert palm.nodes['dual_camera_node'].items() >= {
        'topic': '/palm/left/image_raw', 'right_topic': '/palm/right/image_raw', 'path': own, 'loop': True}.items()
    assert 'rate' not in palm.nodes['dual_camera_node'] and palm.params.endswith('areal_dual_sim.yaml')
    tip = planned_sensor(HandSensor('tip', 'psd_finger', 'hand'), given)
    assert tip.nodes['psd_node']['topic'] == '/tip/voltages' and tip.params.endswith('psd_finger.yaml')


@pytest.mark.parametrize(('given', 'reported'), [
    ({'composed': 'maybe'}, 'composed:=maybe is none of true, false'),
    ({'source': 'file'}, 'source:=file is none of sim, device, bag'),
    ({'hand': 'nowhere.yaml'}, 'hand nowhere.yaml: cannot be read'), ({'record': '.'}, 'exists already'),
    ({'source': 'bag'}, 'needs the recording'),
    ({'autostart': 'perhaps'}, 'sensor thumb: autostart:=perhaps is none of')])
def test_a_wrong_argument_is_reported(given, reported):
    with pytest.raises(BadArgument, match=reported) as raised:
        actions(**given)
    assert '\n' not in str(raised.value)


def test_what_is_wrong_with_a_sensor_names_it(tmp_path):
    path = tmp_path / 'hand.yaml'
    path.write_text(yaml.safe_dump({'sensors': [{'name': 'palm', 'type': 'areal_single', 'calibration': 'none.yaml', 'device': '0'}]}))
    with pytest.raises(BadArgument, match='palm.*none.yaml'):
        actions(hand=str(path), source='device')
    path.write_text(yaml.safe_dump({'sensors': [{'name': 'palm', 'type': 'areal_single', 'device': '0', 'rate': 'fast'}]}))
    with pytest.raises(BadArgument, match='palm.*rate:=fast'):
        actions(hand=str(path), source='device')


def test_what_is_not_installed_is_left_out_with_a_word_and_the_files_are_there(processes_of, monkeypatch, tmp_path):
    def missing(name):
        raise processes.PackageNotFoundError(name)
    monkeypatch.setattr(processes, 'get_package_prefix', missing)
    monkeypatch.setattr(processes, 'launch_config', SimpleNamespace(log_dir=str(tmp_path)))
    found = actions(rviz='true', aggregator='true')
    assert not {'rviz2', 'aggregator_node'} & {node for nodes in processes_of(found) for node in nodes}
    assert {path.name for path in tmp_path.iterdir()} > {'hand.rviz', 'hand_diagnostics.yaml'}
    assert [note for note in notes(found) if 'is not installed' in note] == [
        'package rviz2 is not installed: rviz2 is left out, everything else is started',
        'package diagnostic_aggregator is not installed: aggregator_node is left out, everything else is started']


EXAMPLE = Path(__file__).parents[1] / 'hands' / 'example_hand.yaml'
THUMB = {'name': 'thumb', 'type': 'touchpad'}


def hand_of(tmp_path, *sensors, **more):
    path = tmp_path / 'hand.yaml'
    path.write_text(yaml.safe_dump({'sensors': list(sensors), **more}))
    return read_hand(path)


def test_the_example_has_five_sensors_of_four_kinds_in_different_places():
    hand = read_hand(EXAMPLE)
    assert len(hand.sensors) == 5 and len({s.type for s in hand.sensors}) == 4
    assert len({s.xyz for s in hand.sensors}) == 5 and {s.parent for s in hand.sensors} == {hand.frame}


def test_a_pose_by_rpy_turns_about_the_parents_axes(tmp_path):
    sensor, = hand_of(tmp_path, {**THUMB, 'xyz': [1, 2, 3], 'rpy': [0.1, 0.2, 0.3], 'parent': 'palm'}).sensors
    about = [Rotation.from_rotvec(np.eye(3)[k] * angle) for k, angle in enumerate((0.1, 0.2, 0.3))]
    assert (Rotation.from_quat(sensor.quaternion).inv() * about[2] * about[1] * about[0]).magnitude() < 1e-12
    assert sensor.xyz == (1.0, 2.0, 3.0) and sensor.parent == 'palm'


def test_a_pose_by_quaternion_and_none_at_all(tmp_path):
    pad = {'name': 'left/pad', 'type': 'taxel_array'}
    turned, plain = hand_of(tmp_path, {**THUMB, 'quaternion': [0, 0, 0.70711, 0.70711]}, pad).sensors
    assert Rotation.from_quat(turned.quaternion).as_euler('xyz') == pytest.approx([0, 0, np.pi / 2])
    assert (plain.xyz, plain.quaternion, plain.parent, plain.frame) == ((0, 0, 0), (0, 0, 0, 1), 'hand', 'left_pad')


def test_settings_are_text_and_paths_beside_the_file(tmp_path):
    sensor, = hand_of(tmp_path, {**THUMB, 'device': 4711, 'rate': 60, 'calibration': 'cal/thumb.yaml', 'params': '/abs.yaml'}).sensors
    assert sensor.settings == {'device': '4711', 'rate': '60', 'calibration': str(tmp_path / 'cal/thumb.yaml'), 'params': '/abs.yaml'}


@pytest.mark.parametrize(('sensors', 'reported'), [
    ([{**THUMB, 'type': 'camera'}], "sensor thumb: type 'camera' is unknown; choose one of touchpad, "),
    ([THUMB, THUMB], 'sensor thumb: its name is taken'), ([{**THUMB, 'name': 'hand'}], 'sensor hand: its name is taken'),
    ([{**THUMB, 'name': 'left/pad'}, {**THUMB, 'name': 'left_pad'}], 'sensor left_pad: its name is taken'),
    ([{**THUMB, 'colour': 'red'}], "sensor thumb: key 'colour' is unknown; known are name, type"),
    ([{'type': 'touchpad'}], 'number 1: name is missing'),
    ([{'name': 'thumb'}], 'sensor thumb: type is missing'), ([{**THUMB, 'name': '9 lives'}], "name is '9 lives'"),
    ([{**THUMB, 'name': 3}], 'name is 3'),
    ([{**THUMB, 'xyz': [0, 0]}], r'xyz is \[0, 0\], but must be a list of 3 numbers'),
    ([{**THUMB, 'xyz': [0, 0, float('nan')]}], 'xyz is'),
    ([{**THUMB, 'rpy': 'up'}], "rpy is 'up'"), ([{**THUMB, 'quaternion': [0, 0, 0, 2]}], 'of length 2, but must have length 1'),
    ([{**THUMB, 'rpy': [0, 0, 0], 'quaternion': [0, 0, 0, 1]}], 'both given'),
    ([{**THUMB, 'device': ['a']}], "device is \\['a'\\]"),
    ([{**THUMB, 'right_device': 'b'}], 'right_device: a sensor of type .* has one camera at most'),
    ([{**THUMB, 'parent': 'thumb'}], 'hangs on the sensor itself'),
    ([{**THUMB, 'parent': 'index'}, {**THUMB, 'name': 'index', 'parent': 'thumb'}], 'sensor thumb: parent index hangs on'),
    (['thumb'], 'number 1: a sensor must have the form key: value'), ([], 'sensors must be a list of one sensor or more')])
def test_what_is_wrong_is_reported_in_one_line_with_its_place(tmp_path, sensors, reported):
    with pytest.raises(BadArgument, match=reported) as raised:
        hand_of(tmp_path, *sensors)
    assert str(raised.value).startswith(f'hand {tmp_path}/hand.yaml: ') and '\n' not in str(raised.value)


@pytest.mark.parametrize('text', ['sensors: [\n', '- 1\n', 'colour: red\nsensors: []\n', '!!python/object/apply:os.getcwd []\n', '\x00'])
def test_a_file_that_is_no_hand(tmp_path, text):
    (tmp_path / 'bad.yaml').write_text(text)
    with pytest.raises(BadArgument, match='bad.yaml') as raised:
        read_hand(tmp_path / 'bad.yaml')
    assert '\n' not in str(raised.value)
    with pytest.raises(BadArgument, match='cannot be read'):
        read_hand(tmp_path / 'none.yaml')


def test_both_files_are_written_and_named(tmp_path, capsys):
    assert main([str(EXAMPLE), str(tmp_path / 'out')]) == 0
    written = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in written] == ['example_hand.rviz', 'example_hand_diagnostics.yaml']
    displays = yaml.safe_load(written[0].read_text())['Visualization Manager']['Displays']
    assert sum(d.get('Topic', {}).get('Value', '').endswith('/markers') for d in displays) == 5
    assert len(yaml.safe_load(written[1].read_text())['analyzers']['ros__parameters']) == 6


def test_a_file_that_is_no_hand_is_reported(tmp_path, capsys):
    assert main([str(tmp_path / 'none.yaml'), str(tmp_path)]) == 1
    assert 'none.yaml: cannot be read' in capsys.readouterr().err

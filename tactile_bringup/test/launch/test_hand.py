# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from launch.actions import LogInfo
from tactile_bringup.hand.description import HandSensor
from tactile_bringup.launch import arguments as processes, recorded
from tactile_bringup.launch.hand import hand_actions, hand_arguments, planned_sensor, sensor_values
from tactile_driver.errors import BadArgument

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

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Launch of one sensor and of a hand: arguments, processes, recordings; a hand's file and its configurations."""
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from launch import LaunchContext
from launch.actions import LogInfo, Shutdown
from launch_ros.actions import Node
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String

from tactile_bringup import share
from tactile_bringup.hand.configurations import main
from tactile_bringup.hand.description import HandSensor, read_hand
from tactile_bringup.launch import arguments as module, hand as launch_of_hand, recorded
from tactile_bringup.launch.arguments import (
    Playing,
    SensorPlan,
    check,
    completed,
    driver_parameters,
    end_if_wrong,
    processes,
    sensor_actions,
    sensor_arguments,
    sensor_plan,
    values_of,
)
from tactile_bringup.launch.hand import hand_actions, hand_arguments, planned_sensor, sensor_values
from tactile_bringup.launch.recorded import bag_of, recorded_topics
from tactile_driver.errors import BadArgument, BadRecording
from tactile_driver.nodes.runtime.run import EXIT_FAILURE
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.core.sensor_type import SENSOR_TYPES

SOURCES = ('sim', 'device', 'file', 'bag')


def values(sensor_type='touchpad', **given):
    return {name: default for name, (default, _) in sensor_arguments(sensor_type).items()} | given


def actions(sensor_type, **given):
    return sensor_actions(values(sensor_type, **given), sensor_type)


@pytest.fixture
def files(tmp_path):
    video, calibration = tmp_path / 'video.avi', tmp_path / 'mine.yaml'
    video.write_text('')
    calibration.write_text('')
    return {'source': 'file', 'path': str(video)}, str(calibration)


def processes_of(found):
    """The nodes of each process that the actions of a launch file start, in their order."""
    def nodes_of(action):
        words = [word[0].text for word in action.cmd[1:] if hasattr(word[0], 'text')]
        return words[:words.index('--ros-args')] if action.node_executable == 'sensor_nodes' else [action.node_executable]
    return [nodes_of(action) for action in found if isinstance(action, Node)]


def notes(found):
    return [''.join(part.text for part in action.msg) for action in found if isinstance(action, LogInfo)]


@pytest.mark.parametrize('sensor_type', SENSOR_TYPES)
def test_a_simulated_sensor_is_one_process_of_all_its_nodes_and_calibrated(sensor_type):
    kind, found = SENSOR_TYPES[sensor_type], actions(sensor_type)
    assert processes_of(found) == [[kind.driver, kind.perception, kind.view]]
    assert notes(found) == []
    assert processes_of(actions(sensor_type, composed='false', record='new'))[-1] == ['record_node']


@pytest.mark.parametrize('sensor_type', [name for name, kind in SENSOR_TYPES.items() if kind.uncalibrated])
def test_an_uncalibrated_sensor_says_what_is_missing(sensor_type):
    kind, found = SENSOR_TYPES[sensor_type], actions(sensor_type, source='device', device='x')
    assert processes_of(found) == [[kind.driver, kind.perception, kind.view]]
    assert len(notes(found)) == 1 and 'not calibrated' in notes(found)[0]


def test_a_device_that_publishes_newtons_is_calibrated(tmp_path):
    text = open(share('params', 'force_taxels.yaml')).read()
    for unit, says in (('0.0', 1), ('1.0', 0)):
        (tmp_path / 'params.yaml').write_text(text.replace('force_unit: 0.0', f'force_unit: {unit}'))
        found = actions('force_taxels', source='device', device='x', params=str(tmp_path / 'params.yaml'))
        assert len(notes(found)) == says


def test_the_node_gets_the_calibration(files):
    plan = sensor_plan(values('areal_single', calibration=files[1], **files[0]), 'areal_single')
    assert plan.nodes['press_contact_node'] == {'calibration': files[1]}


def test_a_stitching_alone_is_no_calibration_of_presses(files, tmp_path):
    (tmp_path / 'stitching.yaml').write_text('fitted:\n  stitching:\n    seam: 5.0\n')
    plan = sensor_plan(values('areal_dual', calibration=str(tmp_path / 'stitching.yaml'), **files[0]), 'areal_dual')
    assert 'not calibrated' in plan.note


def test_a_calibration_that_the_parameter_file_names_counts(files, tmp_path):
    text = open(share('params', 'areal_dual.yaml')).read().replace('calibration: ""', f'calibration: "{files[1]}"')
    (tmp_path / 'params.yaml').write_text(text)
    plan = sensor_plan(values('areal_dual', params=str(tmp_path / 'params.yaml'), **files[0]), 'areal_dual')
    assert not plan.note and plan.nodes['dual_camera_node']['stitching_path'] == files[1]


def test_a_parameter_file_of_another_type_is_refused(files):
    with pytest.raises(BadArgument, match='is of a gel: launch gel.launch.py'):
        sensor_plan(values(params=share('params', 'gelsight_mini.yaml'), **files[0]), 'touchpad')


@pytest.mark.parametrize('old', ['dot_tracker_node', 'contact_region_node'])
def test_a_section_of_an_earlier_node_is_refused_with_the_name_of_the_present_one(files, tmp_path, old):
    (tmp_path / 'old.yaml').write_text(f'/**/{old}:\n  ros__parameters: {{rows: 9}}\n')
    with pytest.raises(BadArgument, match=f'section {old} is not used.*touchpad_contact_node'):
        sensor_plan(values(params=str(tmp_path / 'old.yaml'), **files[0]), 'touchpad')


@pytest.mark.parametrize('text', ['a: [', 'just words', ''])
@pytest.mark.parametrize('sensor_type', ['touchpad', 'areal_single'])
def test_a_broken_parameter_file_is_reported_in_one_line(tmp_path, files, sensor_type, text):
    path = tmp_path / 'broken.yaml'
    path.write_text(text)
    with pytest.raises(BadArgument, match='broken.yaml') as raised:
        sensor_plan(values(sensor_type, params=str(path), **files[0]), sensor_type)
    assert '\n' not in str(raised.value)


@pytest.mark.parametrize('wrong, reported', [
    ({'source': 'file'}, 'path:='), ({'source': 'bag', 'path': 'nowhere.avi'}, 'nowhere.avi does not exist'),
    ({'params': 'no.yaml'}, 'no.yaml'), ({'source': 'foo'}, 'source:=foo is not one of sim, device, file, bag'),
    ({'rviz': 'maybe'}, 'rviz:=maybe is not one of true, false'), ({'loop': 'twice'}, 'loop:=twice is not one of true, false'),
    ({'stay': 'long'}, 'stay:=long is not one of true, false'),
    ({'autostart': 'maybe'}, 'autostart:=maybe is not one of true, false'),
    ({'composed': 'sensor'}, 'composed:=sensor is not one of true, false'),
    ({'calibration': 'no.yaml'}, 'calibration:=no.yaml'), ({'record': __file__}, 'exists already')])
def test_a_wrong_value_is_reported_in_one_line(wrong, reported):
    with pytest.raises(BadArgument, match=reported) as raised:
        check(values(**wrong), SOURCES)
    assert '\n' not in str(raised.value)


def test_not_every_sensor_has_every_source():
    with pytest.raises(BadArgument, match='source:='):
        sensor_plan(values('psd_finger', source='file', path='x'), 'psd_finger')
    assert sensor_plan(values('areal_dual', source='topics', topic='a', right_topic='b'), 'areal_dual').nodes['dual_camera_node'] == {
        'source': 'topics', 'topic': 'a', 'right_topic': 'b', 'frame_id': 'areal_dual'}


def test_an_argument_that_nobody_knows_is_refused_with_those_known(monkeypatch):
    def given(word, file='touchpad.launch.py'):
        monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'tactile_bringup', file, word])
        context = LaunchContext(argv=[word])
        context.extend_locals({'current_launch_file_path': '/somewhere/touchpad.launch.py'})
        context.launch_configurations.update(values())
        return values_of(context, list(values()))
    with pytest.raises(BadArgument, match='origin.*namespace'):
        given('origin:=bag')
    assert given('source:=sim') == values()
    assert given('origin:=bag', file='of_others.launch.py') == values(), 'which includes this one and has arguments of its own'


def test_only_what_is_given_goes_before_the_parameter_file():
    assert driver_parameters(values(), 'touchpad') == {'source': 'sim'}
    given = {'source': 'file', 'path': 'a.avi', 'rate': '60', 'loop': 'true', 'scene': 'impact', 'device': '0', 'autostart': 'false',
             'topic': '/pad/image_raw'}
    assert driver_parameters(values(**given), 'touchpad') == {**given, 'rate': 60.0, 'loop': True, 'autostart': False}
    assert driver_parameters(values('areal_dual', right_device='1'), 'areal_dual')['right_device'] == '1'


def test_only_the_simulated_specimen_takes_its_own_files():
    sim, file = (completed(values('areal_single', source=source), 'areal_single') for source in ('sim', 'file'))
    assert sim['params'].endswith('areal_single_sim.yaml') and sim['calibration'].endswith('areal_single_sim.yaml')
    assert file['params'].endswith('areal_single.yaml') and file['calibration'] == ''
    assert completed(values('areal_single', calibration='x', params='y'), 'areal_single')['calibration'] == 'x'


def test_rviz_shows_the_topics_in_the_sensors_namespace(monkeypatch):
    monkeypatch.setattr(module, 'get_package_prefix', lambda name: name)
    rviz = actions('taxel_array', rviz='true', namespace='left/pad')[-1]
    assert rviz.node_package == 'rviz2'
    text = Path(''.join(part.text for part in rviz.cmd[2])).read_text()
    page = yaml.safe_load(text)['Visualization Manager']
    assert page['Global Options']['Fixed Frame'] == 'left_pad' and 'taxel_array' not in text
    topics = {display['Topic']['Value'] for display in page['Displays'] if 'Topic' in display}
    assert topics == {f'/left/pad/{name}' for name in ('image_raw', 'image_annotated', 'markers', 'points')}


NODES = {'camera_node': {'device': '1e3', 'rate': 60.0, 'loop': True}, 'touchpad_contact_node': {},
         'markers_node': {'frame_id': 'left_pad'}}


@pytest.fixture
def plan(monkeypatch, tmp_path):
    monkeypatch.setattr(module, 'launch_config', SimpleNamespace(log_dir=str(tmp_path)))
    return SensorPlan('left_pad', '/left/pad', 'a.yaml', NODES, 'bag')


def test_each_node_has_its_own_parameters_with_their_types(plan, tmp_path):
    processes(plan, True, Playing(1))
    page = yaml.safe_load((tmp_path / 'left_pad_parameters.yaml').read_text())
    assert page == {'/left/pad/camera_node': {'ros__parameters': NODES['camera_node']},
                    '/left/pad/markers_node': {'ros__parameters': {'frame_id': 'left_pad'}}}


@pytest.mark.parametrize(('given', 'ends'), [({'source': 'sim'}, False), ({}, True), ({'loop': 'true'}, False), ({'stay': 'true'}, False)])
def test_a_launch_ends_with_its_recording_unless_reported_otherwise(files, given, ends):
    plan = sensor_plan(values(**{**files[0], **given}), 'touchpad')
    assert plan.ends == ends and plan.nodes['camera_node'].get('stay', True) != ends


def test_a_launch_ends_with_the_last_of_its_recordings():
    playing, running = Playing(2), SimpleNamespace(is_shutdown=False)
    over = SimpleNamespace(returncode=0, process_name='thumb-1')
    assert playing.on_exit(over, running) == []
    line, end = playing.on_exit(over, running)
    assert 'is over' in notes([line])[0] and isinstance(end, Shutdown)


@pytest.mark.parametrize(('code', 'said'), [(-11, 'thumb-1: died with exit code -11'), (EXIT_FAILURE, 'wrong')])
def test_a_process_that_dies_while_it_plays_a_recording_ends_the_launch(code, said):
    event = SimpleNamespace(returncode=code, process_name='thumb-1')
    with pytest.raises(BadArgument, match=said):
        Playing(2).on_exit(event, SimpleNamespace(is_shutdown=False))
    assert Playing(1).on_exit(event, SimpleNamespace(is_shutdown=True)) == []


def test_what_is_wrong_ends_the_launch_and_what_dies_does_not():
    running, closing = SimpleNamespace(is_shutdown=False), SimpleNamespace(is_shutdown=True)
    with pytest.raises(BadArgument, match='thumb-1'):
        end_if_wrong(SimpleNamespace(returncode=EXIT_FAILURE, process_name='thumb-1'), running)
    end_if_wrong(SimpleNamespace(returncode=EXIT_FAILURE, process_name='thumb-1'), closing)
    end_if_wrong(SimpleNamespace(returncode=-9, process_name='thumb-1'), running)


RAW = {'touchpad': ['image_raw'], 'areal_dual': ['left/image_raw', 'right/image_raw', 'image_raw'], 'psd_finger': ['voltages'],
       'marker_video': ['image_raw'], 'areal_single': ['image_raw/compressed'], 'camera': ['image_color']}


def write(path, **sensors):
    """A bag with the description, raw data and pictures of each sensor: name -> (type, source)."""
    with BagWriter(path) as bag:
        for name, (sensor_type, source) in sensors.items():
            kind, data = encode(String(data=f'sensor_type: {sensor_type}\nsource: {source}\n'))
            bag.write(f'/{name}/description', kind, 10**9, data)
            for topic in (*RAW[sensor_type], 'image_annotated'):
                kind, data = encode(CompressedImage() if topic.endswith('/compressed') else Image())
                bag.write(f'/{name}/{topic}', kind, 10**9, data)
    return str(path)


def test_one_bag_of_all_or_one_of_each(tmp_path):
    whole = write(tmp_path / 'whole', thumb=('touchpad', 'sim'), index=('touchpad', 'device'))
    write(tmp_path / 'each' / 'thumb', thumb=('touchpad', 'device'))
    assert bag_of(whole, 'index') == whole
    assert bag_of(str(tmp_path / 'each'), 'thumb') == str(tmp_path / 'each' / 'thumb')


def test_the_sensors_own_topics_are_chosen_and_whether_it_was_simulated(tmp_path):
    bag = write(tmp_path / 'bag', pad=('touchpad', 'sim'), palm=('areal_dual', 'device'), tip=('psd_finger', 'sim'))
    none = {}
    assert recorded_topics(bag, 'touchpad', 'touchpad', none) == ({'topic': '/pad/image_raw'}, True)
    assert recorded_topics(bag, 'areal_dual', 'x', none) == (
        {'topic': '/palm/left/image_raw', 'right_topic': '/palm/right/image_raw'}, False)
    assert recorded_topics(bag, 'psd_finger', 'psd_finger', none) == ({'topic': '/tip/voltages'}, True)


def test_a_recording_of_a_replay_knows_that_the_sensor_was_simulated(tmp_path):
    bag = write(tmp_path / 'bag', pad=('touchpad', 'bag\nrecorded: {source: sim}'), tip=('psd_finger', 'bag\nrecorded: {source: device}'))
    assert recorded_topics(bag, 'touchpad', 'touchpad', {}) == ({'topic': '/pad/image_raw'}, True)
    assert recorded_topics(bag, 'psd_finger', 'tip', {}) == ({'topic': '/tip/voltages'}, False)


@pytest.mark.parametrize('given', ['', '/sheet/image_raw', '/sheet/image_raw/compressed'])
def test_a_recording_of_compressed_images(tmp_path, given):
    bag = write(tmp_path / 'bag', sheet=('areal_single', 'sim'))
    assert recorded_topics(bag, 'areal_single', 'x', {'topic': given}) == ({'topic': given or '/sheet/image_raw'}, True)


def test_of_several_of_a_type_the_namespace_or_the_topic_chooses(tmp_path):
    bag = write(tmp_path / 'bag', thumb=('touchpad', 'sim'), index=('touchpad', 'device'))
    assert recorded_topics(bag, 'touchpad', 'index', {}) == ({'topic': '/index/image_raw'}, False)
    assert recorded_topics(bag, 'touchpad', 'touchpad', {'topic': '/thumb/image_raw'}) == ({'topic': '/thumb/image_raw'}, True)
    with pytest.raises(BadArgument, match='/index/.*/thumb/'):
        recorded_topics(bag, 'touchpad', 'touchpad', {})


@pytest.mark.parametrize('wanted', ['areal_single', 'psd_finger'])
def test_a_recording_of_another_type_is_refused_by_name(tmp_path, wanted):
    bag = write(tmp_path / 'bag', pad=('touchpad', 'sim'))
    with pytest.raises(BadArgument, match=f'touchpad.*{wanted}.*touchpad.launch.py'):
        recorded_topics(bag, wanted, wanted, {})


def test_what_is_not_there_is_reported(tmp_path):
    whole = write(tmp_path / 'whole', thumb=('touchpad', 'sim'))
    with pytest.raises(BadArgument, match='/palm.*/thumb/description'):
        bag_of(whole, 'palm')
    with pytest.raises(BadRecording, match='no such file'):
        bag_of(str(tmp_path / 'nowhere'), 'palm')


GIVEN_HAND = {'hand': 'hand.yaml', 'source': 'sim', 'path': '', 'autostart': '', 'loop': '', 'stay': 'false', 'record': '',
         'composed': 'true'}


def hand_of_nodes(**given):
    return hand_actions({name: default for name, (default, _) in hand_arguments().items()} | given)


def test_the_example_hand_is_a_process_for_each_sensor_and_one_for_the_frames():
    found = hand_of_nodes()
    assert notes(found) == []
    assert [nodes[0] for nodes in processes_of(found)] == ['camera_node', 'camera_node', 'psd_node', 'taxel_array_node', 'dual_camera_node',
                                                           'hand_node']
    alone = [node for nodes in processes_of(hand_of_nodes(composed='false')) for node in nodes]
    assert alone.count('camera_node') == 2 and alone[-1] == 'hand_node' and len(alone) == 5 * 3 + 1


@pytest.mark.parametrize('has_publisher', [True, False])
def test_a_described_hand_has_one_publisher_of_its_frames(monkeypatch, has_publisher):
    publisher = Node(package='robot_state_publisher', executable='robot_state_publisher') if has_publisher else LogInfo(msg='missing')
    asked = []
    monkeypatch.setattr(launch_of_hand, 'optional', lambda *_args, **_how: [publisher])
    monkeypatch.setattr(launch_of_hand, 'hand_node', lambda hand, **how: asked.append((hand, how)) or LogInfo(msg=''))
    found = hand_of_nodes(description=share('urdf', 'gripper.urdf.xacro'))
    assert [nodes[0] for nodes in processes_of(found)][:2] == ['taxel_array_node', 'camera_node']
    assert (publisher in found) == has_publisher
    how = {'publish_frames': not has_publisher, 'object': False, 'simulated_joints': True}
    assert asked == [(share('urdf', 'gripper.urdf.xacro'), how)]


def test_a_hand_and_a_description_are_one_too_many(tmp_path):
    with pytest.raises(BadArgument, match='hand and description are both given; give one'):
        hand_of_nodes(hand=str(tmp_path / 'hand.yaml'), description=share('urdf', 'gripper.urdf.xacro'))


def test_a_simulated_hand_has_the_specimens_parameters_whatever_the_real_ones_are():
    own = {'calibration': '/mine.yaml', 'params': '/mine.yaml', 'device': '1', 'rate': '15'}
    sensor = HandSensor('palm', 'areal_dual', 'hand', settings=own)
    values = sensor_values(sensor, GIVEN_HAND)
    assert [values[name] for name in ('params', 'calibration', 'device', 'rate', 'namespace')] == ['', '', '', '15', 'palm']
    plan = planned_sensor(sensor, GIVEN_HAND)
    assert plan.params.endswith('params/areal_dual_sim.yaml')
    assert plan.nodes['press_contact_node']['calibration'].endswith('calibration/areal_dual_sim.yaml')
    real = sensor_values(sensor, {**GIVEN_HAND, 'source': 'device'})
    assert (real['calibration'], real['params'], real['device']) == ('/mine.yaml', '/mine.yaml', '1')


def test_a_recorded_sensor_plays_its_own_topics_with_the_parameters_of_what_was_recorded(monkeypatch):
    own = str(Path(__file__).parent)
    monkeypatch.setattr(recorded, 'bag_of', lambda recording, name: own)
    monkeypatch.setattr(recorded, 'recorded_topics', lambda path, kind, name, topics: (topics, name == 'palm'))
    given = {**GIVEN_HAND, 'source': 'bag', 'path': 'bag', 'loop': 'true'}
    palm = planned_sensor(HandSensor('palm', 'areal_dual', 'hand', settings={'rate': '60', 'params': '/mine.yaml'}), given)
    assert palm.nodes['dual_camera_node'].items() >= {
        'topic': '/palm/left/image_raw', 'right_topic': '/palm/right/image_raw', 'path': own, 'loop': True}.items()
    assert 'rate' not in palm.nodes['dual_camera_node'] and palm.params.endswith('areal_dual_sim.yaml')
    tip = planned_sensor(HandSensor('tip', 'psd_finger', 'hand'), given)
    assert tip.nodes['psd_node']['topic'] == '/tip/voltages' and tip.params.endswith('psd_finger.yaml')


@pytest.mark.parametrize(('given', 'reported'), [
    ({'composed': 'maybe'}, 'composed:=maybe is not one of true, false'),
    ({'source': 'file'}, 'source:=file is not one of sim, device, bag'),
    ({'hand': 'nowhere.yaml'}, 'hand nowhere.yaml: cannot be read'), ({'record': '.'}, 'exists already'),
    ({'source': 'bag'}, 'needs the recording'),
    ({'autostart': 'perhaps'}, 'sensor thumb: autostart:=perhaps is not one of')])
def test_a_wrong_argument_is_reported(given, reported):
    with pytest.raises(BadArgument, match=reported) as raised:
        hand_of_nodes(**given)
    assert '\n' not in str(raised.value)


def test_what_is_wrong_with_a_sensor_names_it(tmp_path):
    path = tmp_path / 'hand.yaml'
    path.write_text(yaml.safe_dump({'sensors': [{'name': 'palm', 'type': 'areal_single', 'calibration': 'none.yaml', 'device': '0'}]}))
    with pytest.raises(BadArgument, match='palm.*none.yaml'):
        hand_of_nodes(hand=str(path), source='device')
    path.write_text(yaml.safe_dump({'sensors': [{'name': 'palm', 'type': 'areal_single', 'device': '0', 'rate': 'fast'}]}))
    with pytest.raises(BadArgument, match='palm.*rate:=fast'):
        hand_of_nodes(hand=str(path), source='device')


def test_what_is_not_installed_is_left_out_with_a_word_and_the_files_are_there(monkeypatch, tmp_path):
    def missing(name):
        raise module.PackageNotFoundError(name)
    monkeypatch.setattr(module, 'get_package_prefix', missing)
    monkeypatch.setattr(module, 'launch_config', SimpleNamespace(log_dir=str(tmp_path)))
    found = hand_of_nodes(rviz='true', aggregator='true')
    assert not {'rviz2', 'aggregator_node'} & {node for nodes in processes_of(found) for node in nodes}
    assert {path.name for path in tmp_path.iterdir()} > {'hand.rviz', 'hand_diagnostics.yaml'}
    assert [note for note in notes(found) if 'is not installed' in note] == [
        'package rviz2 is not installed: rviz2 is left out, everything else is started',
        'package diagnostic_aggregator is not installed: aggregator_node is left out, everything else is started']


EXAMPLE = Path(__file__).parents[2] / 'hands' / 'example_hand.yaml'
THUMB = {'name': 'thumb', 'type': 'touchpad'}


def hand_of(tmp_path, *sensors, **more):
    path = tmp_path / 'hand.yaml'
    path.write_text(yaml.safe_dump({'sensors': list(sensors), **more}))
    return read_hand(path)


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
    ([{**THUMB, 'parent': 'thumb'}], 'parent frame thumb is mounted on the sensor itself'),
    ([{**THUMB, 'parent': 'index'}, {**THUMB, 'name': 'index', 'parent': 'thumb'}], 'sensor thumb: its parent frame index is mounted on'),
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


def test_all_files_are_written_and_named(tmp_path, capsys):
    assert main([str(EXAMPLE), str(tmp_path / 'out')]) == 0
    written = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert [path.name for path in written] == ['example_hand.rviz', 'example_hand_diagnostics.yaml', 'example_hand.urdf.xacro']
    displays = yaml.safe_load(written[0].read_text())['Visualization Manager']['Displays']
    assert sum(d.get('Topic', {}).get('Value', '').endswith('/markers') for d in displays) == 5
    assert len(yaml.safe_load(written[1].read_text())['analyzers']['ros__parameters']) == 6


def test_a_file_that_is_no_hand_is_reported(tmp_path, capsys):
    assert main([str(tmp_path / 'none.yaml'), str(tmp_path)]) == 1
    assert 'none.yaml: cannot be read' in capsys.readouterr().err

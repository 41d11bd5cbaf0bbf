# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Launch of one sensor: arguments, processes, recordings."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from launch import LaunchContext
from launch.actions import LogInfo, Shutdown
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import String
from tactile_bringup.installed import share
from tactile_bringup.launch import arguments as module
from tactile_bringup.launch.arguments import (
    Playing, SensorPlan, check, completed, driver_parameters, end_if_wrong, processes, sensor_actions, sensor_arguments, sensor_plan,
    values_of)
from tactile_bringup.launch.recorded import bag_of, recorded_topics
from tactile_driver.errors import BadArgument, BadRecording
from tactile_driver.nodes.runtime.run import WRONG
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_perception.sensors import SENSOR_TYPES

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


def notes(found):
    return [''.join(part.text for part in action.msg) for action in found if isinstance(action, LogInfo)]


@pytest.mark.parametrize('sensor_type', SENSOR_TYPES)
def test_a_simulated_sensor_is_one_process_of_all_its_nodes_and_calibrated(processes_of, sensor_type):
    kind, found = SENSOR_TYPES[sensor_type], actions(sensor_type)
    assert processes_of(found) == [[kind.driver, *kind.perception, kind.view]]
    assert notes(found) == []
    assert processes_of(actions(sensor_type, composed='false', record='new'))[-1] == ['record_node']


@pytest.mark.parametrize('sensor_type', [name for name, kind in SENSOR_TYPES.items() if kind.uncalibrated])
def test_an_uncalibrated_sensor_says_what_is_missing(processes_of, sensor_type):
    kind, found = SENSOR_TYPES[sensor_type], actions(sensor_type, source='device', device='x')
    perception = kind.perception[:-1] if kind.needs else kind.perception
    assert processes_of(found) == [[kind.driver, *perception, kind.view]]
    assert len(notes(found)) == 1 and 'not calibrated' in notes(found)[0]


def test_a_calibrated_one_tells_touches(files):
    plan = sensor_plan(values('areal_single', calibration=files[1], **files[0]), 'areal_single')
    assert list(plan.nodes) == ['camera_node', 'dot_tracker_node', 'contact_point_node', 'markers_node']
    assert plan.nodes['contact_point_node'] == {'calibration': files[1]}


def test_a_stitching_alone_tells_no_touches(files, tmp_path):
    (tmp_path / 'stitching.yaml').write_text('fitted:\n  stitching:\n    seam: 5.0\n')
    plan = sensor_plan(values('areal_dual', calibration=str(tmp_path / 'stitching.yaml'), **files[0]), 'areal_dual')
    assert list(plan.nodes) == ['dual_camera_node', 'dot_tracker_node', 'markers_node'] and plan.note


def test_a_calibration_that_the_parameter_file_names_counts(files, tmp_path):
    text = open(share('params', 'areal_dual.yaml')).read().replace('calibration: ""', f'calibration: "{files[1]}"')
    (tmp_path / 'params.yaml').write_text(text)
    plan = sensor_plan(values('areal_dual', params=str(tmp_path / 'params.yaml'), **files[0]), 'areal_dual')
    assert 'contact_point_node' in plan.nodes and plan.nodes['dual_camera_node']['stitching_path'] == files[1]


def test_a_contact_region_needs_a_surface(files):
    plan = sensor_plan(values(params=share('params', 'marker_video.yaml'), **files[0]), 'touchpad')
    assert list(plan.nodes) == ['camera_node', 'dot_tracker_node', 'markers_node']


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
    ({'params': 'no.yaml'}, 'no.yaml'), ({'source': 'foo'}, 'source:=foo is none of sim, device, file, bag'),
    ({'rviz': 'maybe'}, 'rviz:=maybe is none of true, false'), ({'loop': 'twice'}, 'loop:=twice is none of true, false'),
    ({'stay': 'long'}, 'stay:=long is none of true, false'),
    ({'autostart': 'maybe'}, 'autostart:=maybe is none of true, false'),
    ({'composed': 'sensor'}, 'composed:=sensor is none of true, false'),
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


NODES = {'camera_node': {'device': '1e3', 'rate': 60.0, 'loop': True}, 'dot_tracker_node': {}, 'markers_node': {'frame_id': 'left_pad'}}


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


@pytest.mark.parametrize(('code', 'said'), [(-11, 'thumb-1: died with exit code -11'), (WRONG, 'wrong')])
def test_a_process_that_dies_while_it_plays_a_recording_ends_the_launch(code, said):
    event = SimpleNamespace(returncode=code, process_name='thumb-1')
    with pytest.raises(BadArgument, match=said):
        Playing(2).on_exit(event, SimpleNamespace(is_shutdown=False))
    assert Playing(1).on_exit(event, SimpleNamespace(is_shutdown=True)) == []


def test_what_is_wrong_ends_the_launch_and_what_dies_does_not():
    running, closing = SimpleNamespace(is_shutdown=False), SimpleNamespace(is_shutdown=True)
    with pytest.raises(BadArgument, match='thumb-1'):
        end_if_wrong(SimpleNamespace(returncode=WRONG, process_name='thumb-1'), running)
    end_if_wrong(SimpleNamespace(returncode=WRONG, process_name='thumb-1'), closing)
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

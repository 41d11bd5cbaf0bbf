# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from launch.actions import LogInfo
from tactile_driver.sources.registry import SOURCES

from tactile_bringup import sensor_launch
from tactile_bringup.sensor_launch import LaunchError, SensorNodes, camera_parameters, check, frame_of, sensor_arguments

VALUES = {'namespace': 'touchpad', 'source': 'sim', 'device': '', 'path': '', 'params': __file__, 'calibration': '', 'rviz': 'false',
          'record': '', 'rate': '', 'loop': '', 'scene': '', 'autostart': '', 'composed': 'true'}


def test_the_arguments_are_those_of_the_contract():
    names = [a.name for a in sensor_arguments('touchpad')]
    assert names[:9] == ['namespace', 'source', 'device', 'path', 'params', 'calibration', 'rviz', 'record', 'rate']
    assert set(names) == set(VALUES)
    assert all(a.description for a in sensor_arguments('touchpad'))


def test_the_sources_are_those_of_the_driver():
    assert sensor_launch.SOURCES == tuple(SOURCES)


def test_good_values_pass(tmp_path):
    check(VALUES)
    check({**VALUES, 'source': 'file', 'path': str(tmp_path), 'record': str(tmp_path / 'new')})


@pytest.mark.parametrize('wrong, told', [
    ({'source': 'file'}, 'path:='), ({'source': 'bag', 'path': 'nowhere.avi'}, 'nowhere.avi does not exist'),
    ({'params': 'no.yaml'}, 'no.yaml'), ({'source': 'foo'}, 'source:=foo is none of sim, device, file, bag'),
    ({'rviz': 'maybe'}, 'rviz:=maybe is none of true, false'), ({'loop': 'twice'}, 'loop:=twice is none of true, false'),
    ({'autostart': 'maybe'}, 'autostart:=maybe is none of true, false'),
    ({'composed': 'maybe'}, 'composed:=maybe is none of sensor, true, false'),
    ({'calibration': 'no.yaml'}, 'calibration:=no.yaml'), ({'record': __file__}, 'exists already')])
def test_a_wrong_value_is_told_in_one_line(wrong, told):
    with pytest.raises(LaunchError, match=told) as raised:
        check({**VALUES, **wrong})
    assert '\n' not in str(raised.value)


@pytest.mark.parametrize('namespace, frame', [('touchpad', 'touchpad'), ('/hand/left/', 'hand_left'), ('', 'touchpad'), ('/', 'touchpad')])
def test_the_frame_is_named_after_the_namespace(namespace, frame):
    assert frame_of({'namespace': namespace}, 'touchpad') == frame


def test_only_what_is_given_goes_before_the_parameter_file():
    assert camera_parameters(VALUES, 'pad') == {'source': 'sim', 'frame_id': 'pad'}
    given = {**VALUES, 'source': 'file', 'path': 'a.avi', 'rate': '60', 'loop': 'true', 'scene': 'impact', 'device': '0',
             'autostart': 'false', 'topic': '/pad/image_raw'}
    assert camera_parameters(given, 'pad') == {'source': 'file', 'frame_id': 'pad', 'path': 'a.avi', 'rate': 60.0, 'loop': True,
                                               'scene': 'impact', 'device': '0', 'autostart': False, 'topic': '/pad/image_raw'}


@pytest.mark.parametrize('rate, told', [('fast', 'is no number'), ('-5', 'must be 0 or more'), ('nan', 'must be 0 or more'),
                                        ('inf', 'must be 0 or more')])
def test_a_rate_that_is_no_rate_is_refused(rate, told):
    with pytest.raises(LaunchError, match=f'rate:={rate} {told}'):
        camera_parameters({**VALUES, 'rate': rate}, 'pad')


def test_without_rviz_one_line_says_so(monkeypatch):
    def missing(name):
        raise sensor_launch.PackageNotFoundError(name)
    monkeypatch.setattr(sensor_launch, 'get_package_prefix', missing)
    actions = SensorNodes({**VALUES, 'rviz': 'true'}).rviz('touchpad.rviz', 'touchpad', ('markers',))
    assert len(actions) == 1 and isinstance(actions[0], LogInfo)
    assert SensorNodes(VALUES).rviz('touchpad.rviz', 'touchpad', ('markers',)) == []


def test_a_recorder_only_where_a_bag_is_named():
    assert SensorNodes(VALUES).recorder() == []
    for composed, more in (('true', {'patience': 0.0}), ('false', {})):
        recorder, = SensorNodes({**VALUES, 'record': 'bag', 'composed': composed}).recorder()
        assert recorder.own == {'bag': 'bag', **more}

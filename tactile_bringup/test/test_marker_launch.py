# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')

from launch import LaunchContext  # noqa: E402
from launch.actions import LogInfo  # noqa: E402

from tactile_bringup.marker_launch import marker_actions, right_arguments, two_camera_parameters, with_calibration  # noqa: E402
from tactile_bringup.sensor_launch import LaunchError, sensor_arguments, share  # noqa: E402

pytestmark = pytest.mark.ros


def actions(sensor_type, **given):
    context, two = LaunchContext(), sensor_type == 'areal_dual'
    for argument in sensor_arguments(sensor_type) + (right_arguments() if two else []):
        argument.execute(context)
    context.launch_configurations.update(given)
    return marker_actions(context, sensor_type, two)


@pytest.fixture
def files(tmp_path):
    video, calibration = tmp_path / 'video.avi', tmp_path / 'mine.yaml'
    video.write_text('')
    calibration.write_text('')
    return {'source': 'file', 'path': str(video)}, str(calibration)


@pytest.mark.parametrize('sensor_type', ['areal_single', 'air_cushion'])
def test_an_uncalibrated_sensor_tracks_markers_and_says_what_is_missing(executables, sensor_type, files):
    found = actions(sensor_type, **files[0])
    assert executables(found) == ['camera_node', 'dot_tracker_node', 'markers_node']
    assert sum(isinstance(action, LogInfo) for action in found) == 1


def test_a_calibrated_one_tells_touches(executables, files):
    assert executables(actions('areal_single', calibration=files[1], **files[0])) == [
        'camera_node', 'dot_tracker_node', 'contact_point_node', 'markers_node']


def test_a_stitching_alone_tells_no_touches(executables, files, tmp_path):
    (tmp_path / 'stitching.yaml').write_text('fitted:\n  stitching:\n    seam: 5.0\n')
    found = actions('areal_dual', calibration=str(tmp_path / 'stitching.yaml'), **files[0])
    assert executables(found) == ['dual_camera_node', 'dot_tracker_node', 'markers_node']
    assert sum(isinstance(action, LogInfo) for action in found) == 1


def test_a_calibration_that_the_parameter_file_names_counts(executables, files, tmp_path):
    text = open(share('params', 'areal_single.yaml')).read().replace('calibration: ""', f'calibration: "{files[1]}"')
    (tmp_path / 'params.yaml').write_text(text)
    assert 'contact_point_node' in executables(actions('areal_single', params=str(tmp_path / 'params.yaml'), **files[0]))


def test_two_cameras_have_a_driver_of_their_own_that_stitches_by_the_calibration(executables, files):
    found = actions('areal_dual', calibration=files[1], right_path=files[0]['path'], **files[0])
    assert executables(found) == ['dual_camera_node', 'dot_tracker_node', 'contact_point_node', 'markers_node']
    given = dict.fromkeys(('device', 'scene', 'loop', 'rate', 'right_device', 'autostart'), '')
    values = {**given, **files[0], 'right_path': 'right.avi', 'calibration': files[1], 'params': share('params', 'areal_dual.yaml')}
    chosen = two_camera_parameters(values, 'sheet')
    assert chosen == {'source': 'file', 'frame_id': 'sheet', 'path': files[0]['path'], 'right_path': 'right.avi',
                      'stitching_path': files[1]}
    assert 'stitching_path' not in two_camera_parameters({**values, 'calibration': ''}, 'sheet')


def test_only_the_simulated_specimen_takes_its_own_calibration():
    assert with_calibration({'source': 'file', 'calibration': ''}, 'areal_single')['calibration'] == ''
    assert with_calibration({'source': 'sim', 'calibration': 'x'}, 'areal_single')['calibration'] == 'x'


def test_a_broken_parameter_file_is_said_in_one_line(files, tmp_path):
    (tmp_path / 'broken.yaml').write_text('a: [')
    with pytest.raises(LaunchError, match='broken.yaml') as error:
        actions('areal_single', params=str(tmp_path / 'broken.yaml'), **files[0])
    assert '\n' not in str(error.value)

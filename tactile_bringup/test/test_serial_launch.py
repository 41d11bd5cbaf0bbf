# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')

from launch import LaunchContext  # noqa: E402
from launch.actions import LogInfo  # noqa: E402

from tactile_bringup.sensor_launch import LaunchError, sensor_arguments  # noqa: E402
from tactile_bringup.serial_launch import PSD_FINGER, TAXEL_ARRAY, serial_actions  # noqa: E402

pytestmark = pytest.mark.ros
NODES = {PSD_FINGER: ['psd_node', 'psd_contact_node', 'finger_markers_node'],
         TAXEL_ARRAY: ['taxel_array_node', 'taxel_contact_node', 'taxel_markers_node']}


@pytest.fixture(params=NODES, ids=lambda sensor: sensor.type)
def sensor(request):
    return request.param


def actions(sensor, **given):
    context = LaunchContext()
    for argument in sensor_arguments(sensor.type):
        argument.execute(context)
    context.launch_configurations.update(given)
    return serial_actions(context, sensor)


def test_driver_perception_and_markers(executables, sensor):
    found = actions(sensor)
    assert executables(found) == NODES[sensor]
    assert not any(isinstance(action, LogInfo) for action in found)  # the simulated specimen is calibrated
    assert executables(actions(sensor, record='somewhere'))[-1] == 'record_node'


def test_without_a_calibration_it_says_so(sensor):
    notes = [action for action in actions(sensor, source='device', device='/dev/x') if isinstance(action, LogInfo)]
    assert len(notes) == 1 and 'not calibrated' in notes[0].msg[0].text


@pytest.mark.parametrize(('given', 'said'), [({'source': 'bag'}, 'path:='), ({'calibration': 'nowhere'}, 'is no file')])
def test_wrong_arguments(sensor, given, said):
    with pytest.raises(LaunchError, match=said):
        actions(sensor, **given)


@pytest.mark.parametrize(('sensor', 'given', 'said'), [(PSD_FINGER, {'source': 'file', 'path': 'x'}, 'none of sim, device, bag'),
                                                       (TAXEL_ARRAY, {'source': 'file'}, 'path:=')], indirect=['sensor'])
def test_a_source_that_not_every_sensor_has(sensor, given, said):
    with pytest.raises(LaunchError, match=said):
        actions(sensor, **given)

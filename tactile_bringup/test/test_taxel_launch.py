# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')

from launch import LaunchContext  # noqa: E402
from launch.actions import LogInfo  # noqa: E402
from launch_ros.actions import Node  # noqa: E402

from tactile_bringup.taxel_launch import SENSOR_TYPE, taxel_actions  # noqa: E402
from tactile_bringup.sensor_launch import LaunchError, sensor_arguments  # noqa: E402

pytestmark = pytest.mark.ros


def actions(**given):
    context = LaunchContext()
    for argument in sensor_arguments(SENSOR_TYPE):
        argument.execute(context)
    context.launch_configurations.update(given)
    return taxel_actions(context)


def executables(found):
    return [action.node_executable for action in found if isinstance(action, Node)]


def test_driver_perception_and_markers():
    found = actions()
    assert executables(found) == ['taxel_array_node', 'taxel_contact_node', 'taxel_markers_node']
    assert not any(isinstance(action, LogInfo) for action in found)  # the simulated array is calibrated
    assert executables(actions(record='somewhere'))[-1] == 'record_node'


def test_without_a_calibration_it_says_so():
    notes = [action for action in actions(source='device', device='/dev/x') if isinstance(action, LogInfo)]
    assert len(notes) == 1 and 'not calibrated' in notes[0].msg[0].text


@pytest.mark.parametrize(('given', 'said'), [({'source': 'file'}, 'path:='),
                                             ({'source': 'bag'}, 'path:='), ({'calibration': 'nowhere'}, 'is no file')])
def test_wrong_arguments(given, said):
    with pytest.raises(LaunchError, match=said):
        actions(**given)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Each launch file alone, for launch_testing: it starts, its first results come, nobody complains, all processes end with exit code 0.

test_launch_files.py runs it; by itself: launch_test launch_files.py
"""
import re
import tempfile
import unittest
from pathlib import Path

import launch_testing
import rclpy
import yaml
from ament_index_python.packages import get_package_share_directory
from geometry_msgs.msg import WrenchStamped
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_testing.actions import ReadyToTest
from launch_testing_ros import WaitForTopics
from tactile_perception.sensors import SENSOR_TYPES
from tactile_msgs.msg import Contacts

FOLDER = Path(get_package_share_directory('tactile_bringup')) / 'launch'
HAND = {'sensors': [{'name': 'left/pad', 'type': 'taxel_array', 'rate': 50}, {'name': 'tip', 'type': 'psd_finger', 'rate': 500}]}
#: launch file -> topics whose first message is its result
RESULTS = {**{name: [(f'/{name}/contacts', Contacts)] for name in SENSOR_TYPES},
           'hand': [('/left/pad/contacts', Contacts), ('/tip/contacts', Contacts)],
           'calibrate': [('/stage/wrench', WrenchStamped)],
           'demo': [('/touchpad/contacts', Contacts)]}
#: launch file -> the node of a process beside the sensors'
BESIDE = {'hand': '/hand_frames_node', 'calibrate': '/areal_single/calibrate_node', 'demo': '/touchpad/demo'}
_WRITTEN = tempfile.TemporaryDirectory()


def arguments(name):
    """The arguments that a launch file cannot do without, and slow sensors for a busy machine."""
    if name == 'hand':
        hand = Path(_WRITTEN.name) / 'hand.yaml'
        hand.write_text(yaml.safe_dump(HAND))
        return {'hand': str(hand)}
    if name == 'calibrate':
        return {'simulated_stage': 'true', 'probe': 'stage_tip', 'wrench': '/stage/wrench', 'output': f'{_WRITTEN.name}/sheet.yaml'}
    return {'out': _WRITTEN.name, 'rate': '10', 'seconds': '600'} if name == 'demo' else {}


@launch_testing.parametrize('name', RESULTS)
def generate_test_description(name):
    """The launch file, and word that the tests may begin."""
    source = PythonLaunchDescriptionSource(str(FOLDER / f'{name}.launch.py'))
    return LaunchDescription([IncludeLaunchDescription(source, launch_arguments=arguments(name).items()), ReadyToTest()])


class TestResults(unittest.TestCase):
    """While the processes run."""

    def test_first_results_come(self, name):
        with WaitForTopics(RESULTS[name], timeout=180.0) as topics:
            self.assertEqual(topics.topics_not_received(), set())

    def test_all_nodes_have_begun(self, name):
        """An interrupt ends a process that has not, by the signal."""
        rclpy.init()
        node = rclpy.create_node('looker')
        self.assertTrue(node.wait_for_node(BESIDE.get(name, '/looker'), 60.0))
        node.destroy_node()
        rclpy.shutdown()


@launch_testing.post_shutdown_test()
class TestEnd(unittest.TestCase):
    """After launch has ended the processes as Ctrl-C does."""

    def test_exit_codes_are_0(self, proc_info):
        launch_testing.asserts.assertExitCodes(proc_info)

    def test_nobody_complains(self, proc_output):
        lines = [line for output in proc_output for line in output.text.decode().splitlines()]
        self.assertEqual([line for line in lines if re.search(r'WARN|ERROR|FATAL|Traceback', line)], [])

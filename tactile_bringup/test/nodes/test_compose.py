# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Several nodes in one process: what they are given, and that what they compute does not depend on who shares a process."""
import json
import os

import pytest
import rclpy
from ament_index_python.packages import get_package_share_directory
from rclpy.executors import SingleThreadedExecutor
from watching import Watcher

from tactile_bringup.nodes.compose import made
from tactile_bringup.simulate.bags import write_scene
from tactile_driver.errors import BadArgument
from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_msgs.msg import ContactRegion
from tactile_perception.tools import process_bag


@pytest.mark.parametrize(('names', 'reported'), [(['camera_node', 'x'], "'x'.*camera_node"),
                                             ([], 'node')])
def test_a_list_that_is_none(names, reported):
    with pytest.raises(BadArgument, match=reported):
        next(made(names))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp('compose') / 'bag'
    write_scene(path, 'sphere_press', rate=5.0, namespace='pad', frames=14)
    return path


PARAMS = os.path.join(get_package_share_directory('tactile_bringup'), 'params', 'touchpad_sim.yaml')


@pytest.fixture
def nodes(bag, tmp_path):
    """Two nodes of one process, given what launch gives them."""
    own = {'source': 'bag', 'path': str(bag), 'topic': '/pad/image_raw', 'rate': 0.0, 'frame_id': 'pad'}
    (tmp_path / 'own.yaml').write_text(json.dumps({'/pad/camera_node': {'ros__parameters': own}}))
    words = ['--ros-args', '-r', '__ns:=/pad', '--params-file', PARAMS, '--params-file', str(tmp_path / 'own.yaml')]
    rclpy.init(args=words)
    made_nodes = list(made(['camera_node', 'touchpad_contact_node']))
    yield made_nodes
    for node in made_nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def processed(bag, folder):
    """The regions that process_bag makes of a recording."""
    assert process_bag.main([str(bag), str(folder / 'estimates'), '--params', PARAMS]) == 0
    with BagReader(folder / 'estimates') as reader:
        return [decode(message.data, message.type_name) for message in reader.messages({'/pad/contact_region'})]


@pytest.mark.full
def test_each_frame_is_done_as_process_bag_does_it_without_an_image_in_the_middleware(nodes, bag, tmp_path):
    alone, ear, executor = processed(bag, tmp_path), Watcher('listener'), SingleThreadedExecutor()
    assert len(alone) == 14 and alone[0].area == 0 and alone[-1].area > 10e-6
    expected = {stamp_ns_of(region.header): str(region) for region in alone}
    for node in nodes:
        executor.add_node(node)
    regions = ear.collect(ContactRegion, '/pad/contact_region', 50)

    def heard():
        executor.spin_once(timeout_sec=0.02)
        return regions and stamp_ns_of(regions[-1].header) == max(expected)
    try:
        ear.until(heard)
        found = {stamp_ns_of(region.header): str(region) for region in regions}
        assert len(found) >= 5 and found.items() <= expected.items(), 'NaN and all; the middleware may lose some'
        for topic in ('image_raw', 'camera_info', 'dots'):
            assert ear.node.count_subscribers(f'/pad/{topic}') == 0, topic
    finally:
        ear.close()
        executor.shutdown()

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""taxel_array.launch.py with the simulated array: results, stamps, frames, accuracy and shutdown."""
import pathlib

import numpy as np
import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from geometry_msgs.msg import WrenchStamped  # noqa: E402
from sensor_msgs.msg import Image, PointCloud2  # noqa: E402
from tactile_msgs.msg import ContactRegion, Contacts, Slip  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

pytestmark = pytest.mark.ros
RESULTS = {'contact_region': ContactRegion, 'contacts': Contacts, 'slip': Slip, 'wrench': WrenchStamped}
TOPICS = {'image_raw': Image, 'markers': MarkerArray, 'points': PointCloud2, **RESULTS,
          **{f'ground_truth/{topic}': kind for topic, kind in RESULTS.items()}}


def test_results_under_the_stamps_of_their_images(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'taxel_array.launch.py', 'namespace:=left/pad', 'scene:=demo', 'rate:=30')
    ear = listen({f'/left/pad/{topic}': kind for topic, kind in TOPICS.items()})
    slips = ear.heard['/left/pad/slip']
    assert ear.wait_for(lambda: {Slip.NONE, Slip.INCIPIENT, Slip.GROSS} <= {m.state for m in list(slips)}
                        and len(ear.heard['/left/pad/markers']) > 20 and len(ear.heard['/left/pad/image_raw']) > 60, 60), launched.log
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []
    for topic in TOPICS:
        frames = {m.header.frame_id if hasattr(m, 'header') else m.markers[0].header.frame_id for m in ear.heard[f'/left/pad/{topic}']}
        assert frames == {'left_pad'}, topic
    for topic in (*RESULTS, 'points'):
        stamps, images = ear.stamps(f'/left/pad/{topic}'), ear.stamps('/left/pad/image_raw')
        assert stamps == sorted(set(stamps))
        # from the first image received here: discovery may connect this test to the images later than to the results
        assert {stamp for stamp in stamps if images[0] <= stamp <= images[-1]} <= set(images)
    true = dict(zip(ear.stamps('/left/pad/ground_truth/wrench'), ear.heard['/left/pad/ground_truth/wrench']))
    found = zip(ear.stamps('/left/pad/wrench'), ear.heard['/left/pad/wrench'])
    errors = [m.wrench.force.z / true[s].wrench.force.z - 1 for s, m in found if s in true and -true[s].wrench.force.z > 5]
    assert len(errors) > 20 and np.median(np.abs(errors)) < 0.08


def test_rviz_is_set_up_for_what_comes(ros2):
    file = pathlib.Path(get_package_share_directory('tactile_bringup')) / 'rviz' / 'taxel_array.rviz'
    shown = yaml.safe_load(file.read_text())['Visualization Manager']
    assert [d['Topic']['Value'] for d in shown['Displays'] if 'Topic' in d] == [
        f'/taxel_array/{name}' for name in ('markers', 'points', 'image_annotated', 'image_raw')]
    assert shown['Global Options']['Fixed Frame'] == 'taxel_array'


def test_a_wrong_argument_is_told_in_one_line(ros2):
    launched = ros2('launch', 'tactile_bringup', 'taxel_array.launch.py', 'calibration:=nowhere')
    assert launched.wait(30) != 0
    assert 'calibration:=nowhere' in launched.log and len(launched.log.splitlines()) == 3, launched.log

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""psd_finger.launch.py with the simulated finger: results, stamps, frames, accuracy and shutdown."""
import pathlib

import numpy as np
import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402
from tactile_msgs.msg import Contacts, PsdVoltages  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

pytestmark = pytest.mark.ros
TOPICS = {'voltages': PsdVoltages, 'contacts': Contacts, 'ground_truth/contacts': Contacts, 'markers': MarkerArray,
          'image_annotated': Image}


def normal_of(contact):
    return np.array([contact.normal.x, contact.normal.y, contact.normal.z])


def test_contacts_under_the_stamps_of_their_samples(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'psd_finger.launch.py', 'namespace:=left/tip', 'scene:=grid', 'rate:=1000')
    ear = listen({f'/left/tip/{topic}': kind for topic, kind in TOPICS.items()})
    contacts, truths = ear.heard['/left/tip/contacts'], ear.heard['/left/tip/ground_truth/contacts']
    assert ear.wait_for(lambda: sum(bool(message.contacts) for message in list(contacts)) > 150
                        and all(len(heard) > (10 if 'image' in topic else 150) for topic, heard in ear.heard.items()), 60), launched.log
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == []
    for topic in TOPICS:
        frames = {m.header.frame_id if hasattr(m, 'header') else m.markers[0].header.frame_id for m in ear.heard[f'/left/tip/{topic}']}
        assert frames == {'left_tip'}, topic
    stamps = ear.stamps('/left/tip/contacts')
    assert stamps == sorted(set(stamps))
    steps = np.diff(ear.stamps('/left/tip/voltages')) * 1e-9
    assert np.median(steps) == pytest.approx(0.005, abs=1e-4)
    known, truths = np.array(ear.stamps('/left/tip/ground_truth/contacts')), list(truths)
    true = [truths[k].contacts for k in np.searchsorted(known, stamps, side='right') - 1]
    errors = [np.degrees(np.linalg.norm(normal_of(m.contacts[0]) - normal_of(there[0]))) for m, there in zip(contacts, true)
              if m.contacts and there]
    assert len(errors) > 50 and np.median(errors) < 1.5


def test_rviz_is_set_up_for_what_comes(ros2):
    file = pathlib.Path(get_package_share_directory('tactile_bringup')) / 'rviz' / 'psd_finger.rviz'
    shown = yaml.safe_load(file.read_text())['Visualization Manager']
    assert [d['Topic']['Value'] for d in shown['Displays'] if 'Topic' in d] == ['/psd_finger/markers', '/psd_finger/image_annotated']
    assert shown['Global Options']['Fixed Frame'] == 'psd_finger'


@pytest.mark.parametrize(('words', 'told'), [(('source:=file', 'path:=.'), 'source:=file'),
                                             (('calibration:=nowhere',), 'calibration:=nowhere')])
def test_a_wrong_argument_is_told_in_one_line(ros2, words, told):
    launched = ros2('launch', 'tactile_bringup', 'psd_finger.launch.py', *words)
    assert launched.wait(30) != 0
    assert told in launched.log and len(launched.log.splitlines()) == 3, launched.log

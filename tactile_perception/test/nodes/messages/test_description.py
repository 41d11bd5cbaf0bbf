# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from tactile_driver.nodes.messages.conversions import static_transform  # noqa: E402
from tactile_perception.nodes.messages.description import description_messages  # noqa: E402

pytestmark = pytest.mark.ros


def test_description_and_frames_under_one_stamp():
    tip = static_transform('left_tip', 'left_tip_tip', (0.0, 0.0, 0.016))
    told = list(description_messages(1_500_000_000, 'psd_finger', 'left_tip', {'source': 'sim', 'scene': 'rest'}, [tip]))
    assert [(stamp, topic) for stamp, topic, _ in told] == [(1_500_000_000, 'description'), (1_500_000_000, '/tf_static')]
    about, frame = yaml.safe_load(told[0][2].data), told[1][2].transforms[0]
    assert about == {'sensor_type': 'psd_finger', 'frame_id': 'left_tip', 'source': 'sim', 'scene': 'rest'}
    assert (frame.header.frame_id, frame.child_frame_id, frame.header.stamp.sec) == ('left_tip', 'left_tip_tip', 1)
    assert frame.transform.translation.z == 0.016 and frame.transform.rotation.w == 1.0

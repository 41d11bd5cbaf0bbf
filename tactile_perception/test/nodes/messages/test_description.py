# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
import yaml

pytest.importorskip('rclpy', reason='ROS is not sourced')

from tactile_perception.nodes.messages.description import camera_pose, description_messages, static_transform  # noqa: E402

pytestmark = pytest.mark.ros


def turned(quaternion, point):
    """The point (3,) turned by the quaternion x, y, z, w: v + 2 w (q x v) + 2 q x (q x v)."""
    axis, w = np.array(quaternion[:3]), quaternion[3]
    return point + 2 * w * np.cross(axis, point) + 2 * np.cross(axis, np.cross(axis, point))


@pytest.mark.parametrize('rotation', [(0.0, 0.0, 0.0), (0.4, -0.2, 0.9), (np.pi, 0.0, 0.0)])
def test_what_the_camera_sees_is_brought_back_to_where_it_is_in_the_sensor_frame(rotation):
    translation, point = np.array([0.01, -0.02, 0.05]), np.array([0.003, 0.004, -0.001])
    seen = cv2.Rodrigues(np.array(rotation))[0] @ point + translation
    at, quaternion = camera_pose(np.array(rotation), translation)
    np.testing.assert_allclose(turned(quaternion, seen) + at, point, atol=1e-15)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)


def test_description_and_frames_under_one_stamp():
    tip = static_transform('left_tip', 'tip', (0.0, 0.0, 0.016))
    told = list(description_messages(1_500_000_000, 'psd_finger', 'left_tip', {'source': 'sim', 'scene': 'rest'}, [tip]))
    assert [(stamp, topic) for stamp, topic, _ in told] == [(1_500_000_000, 'description'), (1_500_000_000, '/tf_static')]
    about, frame = yaml.safe_load(told[0][2].data), told[1][2].transforms[0]
    assert about == {'sensor_type': 'psd_finger', 'frame_id': 'left_tip', 'source': 'sim', 'scene': 'rest'}
    assert (frame.header.frame_id, frame.child_frame_id, frame.header.stamp.sec) == ('left_tip', 'left_tip_tip', 1)
    assert frame.transform.translation.z == 0.016 and frame.transform.rotation.w == 1.0

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The frames of cameras in the sensor frame."""
import cv2
import numpy as np
import pytest
from tactile_driver.nodes.messages.transforms import camera_transforms


def turned(quaternion, point):
    """The point (3,) turned by the quaternion x, y, z, w: v + 2 w (q x v) + 2 q x (q x v)."""
    axis, w = np.array(quaternion[:3]), quaternion[3]
    return point + 2 * w * np.cross(axis, point) + 2 * np.cross(axis, np.cross(axis, point))


@pytest.mark.parametrize('rotation', [(0.0, 0.0, 0.0), (0.4, -0.2, 0.9), (np.pi, 0.0, 0.0)])
def test_what_the_camera_sees_is_brought_back_to_where_it_is_in_the_sensor_frame(rotation):
    translation, point = np.array([0.01, -0.02, 0.05]), np.array([0.003, 0.004, -0.001])
    seen = cv2.Rodrigues(np.array(rotation))[0] @ point + translation
    told, = camera_transforms('pad', {'left': (rotation, translation)})
    at, turn = told.transform.translation, told.transform.rotation
    quaternion = turn.x, turn.y, turn.z, turn.w
    assert (told.header.frame_id, told.child_frame_id) == ('pad', 'pad_left_camera_optical')
    np.testing.assert_allclose(turned(quaternion, seen) + [at.x, at.y, at.z], point, atol=1e-15)
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)

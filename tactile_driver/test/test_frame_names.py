# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_driver.frame_names import optical_frame, sensor_frame, stitched_frame


def test_the_sensor_frame_is_named_as_the_namespace():
    assert [sensor_frame(space) for space in ('/left/pad', 'left/pad/', '/pad', '/')] == ['left_pad', 'left_pad', 'pad', '']


@pytest.mark.parametrize('view', ['', 'left', 'right'])
def test_the_picture_of_a_view_is_that_of_both(view):
    assert stitched_frame(optical_frame('left_pad', view)) == 'left_pad_camera_optical'


def test_a_foreign_name_is_left_alone():
    assert stitched_frame('camera_link') == 'camera_link'

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Messages and arrays hold the same, what was made into a message comes back; what a message cannot mean is refused by name."""
import numpy as np
import pytest
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate
from tactile_perception.errors import BadFrame
from tactile_perception.nodes.messages import conversions as convert

HEADER = Header(frame_id='pad')
HEADER.stamp.sec, HEADER.stamp.nanosec = 12, 500_000_000


def some_tracks(xyz=True):
    uv = np.array([[10.5, 20.25], [30.0, 40.0]])
    return DotTracks(2, 3, np.array([1, 5]), uv, np.array([80.0, np.nan]), np.array([0.02, 0.03]), np.array([[1.0, 2.0], [np.nan, np.nan]]),
                     np.array([[0.001, 0.002, 0.01], [np.nan] * 3]) if xyz else None)


def test_tracks_go_through_a_message_and_back():
    there = convert.tracks_to_message(some_tracks(), HEADER)
    back = convert.tracks_from_message(there)
    assert there.header.frame_id == 'pad' and (back.rows, back.columns) == (2, 3)
    for name in ('id', 'uv', 'area', 'duv', 'xyz'):
        assert getattr(back, name) == pytest.approx(getattr(some_tracks(), name), rel=1e-7, nan_ok=True)
    assert np.isnan(back.sigma).all()
    assert convert.tracks_from_message(convert.tracks_to_message(some_tracks(xyz=False), HEADER)).xyz is None


def test_nothing_touching_is_nan_and_empty_not_zero():
    region = convert.region_to_message(ContactRegionEstimate(np.array([3]), np.array([0], np.uint8)), HEADER)
    assert region.area == 0 and not region.outlines and list(region.dot_id) == [3]
    unknown = [region.centroid.x, region.normal.z, region.orientation, region.major_axis, region.motion.rotation.w, region.motion_interval]
    assert np.isnan(unknown).all()
    slip = convert.slip_to_message(SlipEstimate(), HEADER)
    assert slip.state == slip.NONE and np.isnan([slip.slipping_fraction, slip.velocity.linear.x, slip.rotation_center.y]).all()
    assert convert.contacts_to_message([], HEADER).contacts == []


def test_a_camera_of_zeros_is_uncalibrated_and_another_model_is_refused():
    info = CameraInfo(k=[700.0, 0, 320, 0, 710, 240, 0, 0, 1], d=[0.1, 0.2, 0.0, 0.0], distortion_model='plumb_bob')
    matrix, distortion = convert.camera_matrices(info)
    assert matrix[1, 1] == 710 and list(distortion) == [0.1, 0.2, 0, 0, 0]
    assert convert.camera_matrices(CameraInfo()) is None
    info.distortion_model = 'equidistant'
    with pytest.raises(BadFrame, match='equidistant'):
        convert.camera_matrices(info)
    info.distortion_model, info.d = 'plumb_bob', [0.0] * 8
    with pytest.raises(BadFrame, match='8 distortion'):
        convert.camera_matrices(info)


def same(a, b, names):
    for name in names:
        for one, other in zip(np.atleast_1d(getattr(a, name)), np.atleast_1d(getattr(b, name))):
            np.testing.assert_allclose(one, other, rtol=1e-6, equal_nan=True)


def test_contacts():
    made = [ContactEstimate(3, np.array([1e-3, 2e-3, 3e-3]), np.array([0, 0, 1.0]), 1e-3, np.nan, np.diag([1e-8, 2e-8, 3e-8]), 5, None)]
    back = convert.contacts_from_message(convert.contacts_to_message(made, HEADER))
    assert len(back) == 1 and len(back[0].members) == 0
    same(made[0], back[0], ('id', 'position', 'normal', 'depth', 'force', 'position_covariance', 'flags'))


def test_a_region():
    loop = np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]])
    made = ContactRegionEstimate(np.array([4, 7]), np.array([1, 2], np.uint8), [loop], [loop / 2], 1e-6, np.ones(3), np.array([0, 0, 1.0]),
                                 0.1, 2e-3, 1e-3, np.zeros(3), np.array([0, 0, 0, 1.0]), 0.05)
    back = convert.region_from_message(convert.region_to_message(made, HEADER))
    same(made, back, ('dot_id', 'dot_state', 'outlines', 'holes', 'area', 'centroid', 'normal', 'orientation', 'major_axis', 'minor_axis',
                      'motion_translation', 'motion_rotation', 'motion_interval'))


def test_slip_and_wrench():
    made = SlipEstimate(1, 0.5, np.arange(3.0), np.arange(3.0), np.full(3, np.nan), *(np.arange(2.0) + k for k in range(4)))
    back = convert.slip_from_message(convert.slip_to_message(made, HEADER))
    same(made, back, ('state', 'slipping_fraction', 'linear', 'angular', 'rotation_center', 'x', 'y', 'vx', 'vy'))
    assert convert.wrench_from_message(convert.wrench_to_message(np.arange(6.0), HEADER)).tolist() == [0, 1, 2, 3, 4, 5]

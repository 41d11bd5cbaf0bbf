# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What was made into a message comes back the same."""

import numpy as np
import pytest

pytest.importorskip('tactile_msgs.msg')
from std_msgs.msg import Header  # noqa: E402
from tactile_perception.common.estimates import ContactEstimate, ContactRegionEstimate, SlipEstimate  # noqa: E402
from tactile_perception.nodes.messages import conversions as convert  # noqa: E402

HEADER = Header(frame_id='pad')


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

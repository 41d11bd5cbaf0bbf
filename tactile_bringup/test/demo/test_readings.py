# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, Transform, Vector3, WrenchStamped
from tactile_bringup.demo.summary import reading_of
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip


def test_all_messages_of_a_touch():
    turn = Quaternion(x=0.0, y=0.0, z=-math.sin(0.1), w=-math.cos(0.1))  # the same turn as (z, w) positive
    region = ContactRegion(dot_id=[1, 2, 3], dot_state=[0, 2, 2], area=4e-5, motion=Transform(translation=Vector3(x=1e-3), rotation=turn),
                           motion_interval=0.5)
    wrench = WrenchStamped()
    wrench.wrench.force = Vector3(x=3.0, z=-4.0)
    found = {'dots': DotTracks(id=[1, 2, 3], du=[3.0, 0.0, float('nan')], dv=[4.0, 1.0, float('nan')]), 'contact_region': region,
             'contacts': Contacts(contacts=[Contact(depth=1e-3), Contact(depth=float('nan'))]), 'wrench': wrench,
             'slip': Slip(state=Slip.GROSS, slipping_fraction=0.75)}
    reading = reading_of(found, 5.0, 0.02)
    assert (reading.stamp_s, reading.latency_s, reading.dots, reading.displacement) == (5.0, 0.02, 3, 5.0)
    assert reading.states == (1, 0, 2) and reading.touches == 2
    assert (reading.depth, reading.force, reading.slip, reading.slipping) == (1e-3, 5.0, 'gross slip', 0.75)
    assert reading.motion == pytest.approx((1e-3, 0, 0, 0, 0, 0.2)) and reading.motion_interval == 0.5


def test_what_is_missing_is_not_known():
    reading = reading_of({'dots': DotTracks()}, 1.0, 0.01)
    assert reading.dots == 0 and np.isnan(reading.displacement) and reading.states == () and reading.slip == ''


def test_nothing_touches():
    found = {'contact_region': ContactRegion(dot_id=[1], dot_state=[0]), 'contacts': Contacts(), 'wrench': WrenchStamped()}
    reading = reading_of(found, 1.0, 0.0)
    assert reading.touches == 0 and np.isnan(reading.force) and reading.states == (1, 0, 0)

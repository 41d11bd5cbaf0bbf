# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Invalid messages of dots and results are refused with the name of the wrong field; unknown values pass."""
from array import array

import numpy as np
import pytest
from geometry_msgs.msg import Point, Point32, Polygon, Vector3, Wrench, WrenchStamped
from sensor_msgs.msg import Image
from tactile_msgs.msg import Contact, ContactRegion, Contacts, DotTracks, Slip
from tactile_perception.errors import BadFrame
from tactile_perception.nodes.messages.conversions import check_message

NAN = float('nan')


def floats(*values):
    return array('f', values)


def dots(**changes):
    good = {'rows': 2, 'columns': 3, 'id': array('I', [1, 5]), 'u': floats(1, 2), 'v': floats(3, 4), 'area': floats(80, NAN),
            'du': floats(0, NAN), 'dv': floats(0, NAN), 'x': floats(0, NAN), 'y': floats(0, NAN), 'z': floats(0, NAN)}
    return DotTracks(**{**good, **changes})


def test_valid_and_unknown_values_pass():
    unknown = Point(x=NAN, y=NAN, z=NAN)
    for message in (dots(), dots(x=floats(), y=floats(), z=floats()), DotTracks(), Image(), ContactRegion(), Contacts(), Slip(),
                    ContactRegion(centroid=unknown, orientation=NAN, outlines=[Polygon(points=[Point32(x=1e-3)])]),
                    Contacts(contacts=[Contact(position=unknown, depth=NAN, position_covariance=np.full(9, NAN))]),
                    Slip(x=floats(NAN), y=floats(0), vx=floats(1), vy=floats(NAN), rotation_center=unknown),
                    WrenchStamped(wrench=Wrench(force=Vector3(x=NAN, y=1.0, z=-1e3)))):
        check_message(message)


@pytest.mark.parametrize('changes, reason', [
    ({'u': floats(1)}, 'u has 1 entries, id has 2'), ({'dv': floats()}, 'dv has 0'), ({'x': floats(1)}, 'x, y, z have 1, 2, 2'),
    ({'id': array('I', [1, 6])}, 'beyond the grid of 6'), ({'id': array('I', [1, 2**32 - 1])}, 'beyond the grid'),
    ({'id': array('I', [5, 5])}, 'twice'), ({'u': floats(1, NAN)}, 'u holds nan'), ({'v': floats(1, np.inf)}, 'v holds inf'),
    ({'du': floats(1, 1e30)}, r'du holds 1e\+30'), ({'area': floats(1, 0)}, 'not above 0'),
    ({'area': floats(1, -np.inf)}, 'area holds -inf'),
    ({'z': floats(1, 1e9)}, r'z holds 1e\+09')])
def test_invalid_dots_are_refused(changes, reason):
    with pytest.raises(BadFrame, match=reason):
        check_message(dots(**changes))


def test_a_pattern_without_a_grid_has_any_indices():
    check_message(dots(rows=0, columns=0, id=array('I', [7, 2**32 - 1])))


@pytest.mark.parametrize('message, reason', [
    (ContactRegion(dot_id=array('I', [1]), dot_state=array('B', [3])), '1 dots with 1 states'),
    (ContactRegion(dot_id=array('I', [1, 2]), dot_state=array('B', [1])), '2 dots with 1 states'),
    (ContactRegion(area=1e9), 'area holds'), (ContactRegion(normal=Vector3(z=np.inf)), 'normal holds inf'),
    (ContactRegion(holes=[Polygon(points=[Point32(x=NAN)])]), 'holes holds nan'),
    (ContactRegion(motion_interval=np.inf), 'motion_interval'),
    (Contacts(contacts=[Contact(), Contact(position=Point(y=-np.inf))]), 'position holds -inf'),
    (Contacts(contacts=[Contact(position_covariance=np.full(9, 1e300))]), 'position_covariance holds'),
    (Slip(state=3), 'state 3 is none'), (Slip(x=floats(1)), 'y has 0 entries, x has 1'),
    (Slip(slipping_fraction=np.inf), 'slipping_fraction'),
    (WrenchStamped(wrench=Wrench(torque=Vector3(x=np.inf))), 'wrench holds inf')])
def test_invalid_results_are_refused(message, reason):
    with pytest.raises(BadFrame, match=reason):
        check_message(message)


@pytest.mark.parametrize('sec, nanosec', [(-1, 0), (-2**31, 0), (0, 10**9), (2**31 - 1, 2**32 - 1)])
def test_invalid_stamps_are_refused(sec, nanosec):
    message = Image()
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    with pytest.raises(BadFrame, match=f'stamp {sec} s'):
        check_message(message)

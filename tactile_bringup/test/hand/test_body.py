# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tactile_bringup.hand.description import Hand, HandSensor
from tactile_bringup.nodes.hand_frames_node import body_markers


def ends(marker):
    """Both ends (2, 3), m, of a cylinder, as RViz draws it: along its own z axis."""
    p, q = marker.pose.position, marker.pose.orientation
    half = Rotation.from_quat([q.x, q.y, q.z, q.w]).apply([0.0, 0.0, 0.5 * marker.scale.z])
    return np.array([p.x, p.y, p.z]) + np.stack([-half, half])


def test_rods_lead_from_behind_the_parent_to_the_back_of_each_sensor():
    turned = HandSensor('thumb', 'touchpad', 'palm', (0.1, 0.0, 0.02), (0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)))  # looks along x
    on_it = HandSensor('nail', 'psd_finger', 'thumb', (0.0, 0.0, 0.05))
    first, second, *others = body_markers(Hand('palm', (turned, on_it))).markers
    assert ends(first) == pytest.approx(np.array([(0, 0, -0.04), (0.06, 0, 0.02)]))
    assert ends(second) == pytest.approx(np.array([(0.06, 0, 0.02), (0.1, 0, 0.02)]))
    assert [marker.header.frame_id for marker in (first, second, *others)] == ['palm', 'palm', 'thumb', 'thumb']
    assert len({(marker.ns, marker.id) for marker in (first, second, *others)}) == 4


def test_a_sensor_in_the_frame_of_the_hand_stands_on_one_rod():
    (rod,) = body_markers(Hand('palm', (HandSensor('sheet', 'areal_dual', 'palm'),))).markers
    assert ends(rod) == pytest.approx(np.array([(0, 0, -0.04), (0, 0, 0)]))

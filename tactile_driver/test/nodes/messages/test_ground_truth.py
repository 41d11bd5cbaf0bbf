# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message, region_message, slip_message, wrench_message
from tactile_driver.simulation.truth import Touch, TruthFrame

HEADER = header_of(1_000, 'pad')


def touch(x):
    return Touch(np.array([x, 0.0, 0.01]), np.array([0.0, 0.0, 1.0]), 0.002, 1.5)


def truth(**known):
    return TruthFrame(np.array([0, 5]), np.zeros((2, 2)), np.zeros((2, 3)), np.array([0, 2], np.uint8), **known)


def test_a_touch_keeps_its_number_while_it_lasts():
    numbers = TouchNumbers()
    assert numbers.assign([touch(0.0), touch(0.01)]) == [0, 1]
    assert numbers.assign([touch(0.011), touch(0.001)]) == [1, 0]
    assert numbers.assign([touch(0.012)]) == [1]
    assert numbers.assign([]) == []
    assert numbers.assign([touch(0.012)]) == [2]


def test_contacts():
    message = contacts_message([touch(0.01)], [4], HEADER)
    contact = message.contacts[0]
    assert (contact.id, contact.position.x, contact.normal.z, contact.depth, contact.force) == (4, 0.01, 1.0, 0.002, 1.5)
    assert message.header == HEADER


def test_region():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.5]], float)
    message = region_message(truth(outlines=[square], area=2e-5, centroid=np.array([1.0, 2, 3])), 0.02, HEADER)
    assert list(message.dot_id) == [0, 5] and list(message.dot_state) == [0, 2]
    assert [(p.x, p.y, p.z) for p in message.outlines[0].points] == [tuple(p) for p in square]
    assert message.area == 2e-5 and message.centroid.y == 2.0
    assert math.isnan(message.normal.x) and math.isnan(message.motion.rotation.w) and math.isnan(message.motion_interval)


def test_motion():
    # A quarter turn about x and a way of 3 mm along y.
    message = region_message(truth(motion=np.array([0, 3e-3, 0, np.pi / 2, 0, 0])), 0.02, HEADER)
    turn = message.motion.rotation
    assert message.motion.translation.y == 3e-3 and message.motion_interval == 0.02
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0.5 ** 0.5, 0, 0, 0.5 ** 0.5))
    assert region_message(truth(motion=np.zeros(6)), 0.02, HEADER).motion.rotation.w == 1.0


def test_slip():
    turning = truth(slip_state=2, slipping_fraction=1.0, velocity=np.array([0.01, 0, 0, 0, 0, 2.0]))
    message = slip_message(turning, HEADER)
    assert (message.state, message.slipping_fraction) == (2, 1.0)
    assert message.velocity.linear.x == 0.01
    assert message.velocity.angular.z == 2.0
    assert math.isnan(message.rotation_center.x)


def test_wrench():
    message = wrench_message(truth(wrench=np.arange(6.0)), HEADER)
    assert (message.wrench.force.y, message.wrench.torque.z) == (1.0, 5.0)

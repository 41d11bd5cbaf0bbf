# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.skin.dome import Membrane
from tactile_driver.simulation.skin.motion import Key, Motion, Pose, attitude
from tactile_driver.simulation.skin.tools import tool_named


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=13)


@pytest.mark.parametrize('name, x, height', [('rectangle', 0, 0.013), ('disc', 0.002, 0.013), ('sphere', 0, 0.021),
                                             ('sphere', 0.006, np.sqrt(0.028**2 - 0.006**2) - 0.007),
                                             ('ring', 0, np.sqrt(0.0205**2 - 0.005**2) - 0.007 - 0.0005)])
def test_touching_height_is_where_the_tool_meets_the_cap(membrane, name, x, height):
    found = membrane.touching_height(tool_named(name).distance, np.eye(3), x, 0.0)
    assert found == pytest.approx(height, abs=1e-7)


def test_a_tilted_face_touches_off_its_middle(membrane):
    flat = membrane.touching_height(tool_named('disc').distance, np.eye(3), 0, 0)
    tilted = membrane.touching_height(tool_named('disc').distance, attitude(0, 0, 0.1), 0, 0)
    # the face's plane touches the ball where the ball's normal is the face's
    assert tilted - flat == pytest.approx(membrane.radius * (1 / np.cos(0.1) - 1), abs=1e-7)


def test_the_other_part_of_a_tool_moves_by_itself():
    other = np.array([0.0005, -0.002, -0.0003])
    pose = Pose(np.array([0.001, 0.002, 0.003]), attitude(0.3, 0.2, 0.1), other)
    places = np.array([[-0.006, 0.001, 0.0], [0.006, 0.001, 0.0]])
    seen = pose.to_sensor(places)
    np.testing.assert_allclose(seen - Pose(pose.origin, pose.turn).to_sensor(places), [[0, 0, 0], other], atol=1e-15)
    np.testing.assert_allclose(pose.to_tool(seen), places, atol=1e-15)


def test_motion_passes_its_keys_and_moves_smoothly_between(membrane):
    motion = Motion(tool_named('sphere'), [Key(1, press=0.0), Key(2, press=0.003), Key(4, x=0.004, press=0.003)], membrane)
    assert not motion.covers(0.9) and motion.covers(1.0) and not motion.covers(4.01)
    np.testing.assert_allclose(motion.pose(1).origin, [0, 0, 0.021], atol=1e-7)
    np.testing.assert_allclose(motion.pose(2).origin, [0, 0, 0.018], atol=1e-7)
    assert motion.pose(4).origin[0] == pytest.approx(0.004)
    heights = np.array([motion.pose(t).origin[2] for t in np.linspace(1, 2, 101)])
    assert (np.diff(heights) <= 0).all()
    assert abs(np.diff(heights)[[0, -1]]).max() < 3e-6 < abs(np.diff(heights)[50])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad of the gripper: a skin that bears what the engine's pad bears, and what perception reads from its images."""
import numpy as np
import pytest

pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')

from tactile_bringup.grasp.experiment import TouchpadSensor  # noqa: E402
from tactile_bringup.grasp.objects import OBJECTS, HeldObject  # noqa: E402
from tactile_bringup.grasp.skin import TouchpadFinger, object_distance  # noqa: E402
from tactile_bringup.grasp.world import GraspWorld  # noqa: E402
from tactile_driver.simulation.skin.tools import Pose  # noqa: E402

RATE = 50.0


@pytest.mark.parametrize(('held', 'outside', 'inside'), [
    (HeldObject('box', (0.02, 0.01, 0.03), 0.1), (0.025, 0.0, 0.0), (0.015, 0.0, 0.0)),
    (HeldObject('cylinder', (0.02, 0.03), 0.1), (0.0, 0.025, 0.0), (0.0, 0.015, 0.0)),
    (HeldObject('sphere', (0.02,), 0.1), (0.0, 0.0, 0.025), (0.0, 0.0, 0.015)),
    (HeldObject('ellipsoid', (0.02, 0.02, 0.03), 0.1), (0.025, 0.0, 0.0), (0.015, 0.0, 0.0))])
def test_the_distance_from_an_object(held, outside, inside):
    assert object_distance(held, np.array([outside, inside])) == pytest.approx([0.005, -0.005], rel=0.1)


def pressed(force, frames=25):
    """The truth of the last of some frames in which a box presses with a force, N."""
    finger = TouchpadFinger(OBJECTS['box'], RATE)
    for _ in range(frames):
        seen = finger.advance(Pose(np.array([0.0, 0.0, OBJECTS['box'].size[0]]), np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])),
                              np.array(force))
    return seen.truth


@pytest.mark.parametrize('force', [(0.0, 0.0, -1.0), (0.0, -0.8, -4.0), (0.3, 0.2, -3.0)])
def test_the_skin_bears_the_force_of_the_engine(force):
    assert pressed(force).wrench[:3] == pytest.approx(force, abs=0.03 * np.linalg.norm(force))


def test_a_skin_that_nothing_presses_is_untouched():
    truth = pressed((0.0, 0.0, 0.0), frames=2)
    assert truth.contacts == [] and not truth.wrench.any()


def test_perception_reads_normal_force_and_shear_from_its_images():
    world, sensor, readings = GraspWorld(OBJECTS['box']), TouchpadSensor(OBJECTS['box'], 3), []
    while world.lifted_s < 1.5:
        pressure, truth = world.advance(-1.0 if world.time_s < 0.3 else 4.0)
        if world.time_s > 1.2 and not world.lifted_s >= 0:
            world.lift()
        reading = sensor.read(pressure, truth)
        if reading is not None and world.lifted_s > 1.2:
            readings.append((reading.force + truth.pad_force[2], reading.shear - np.linalg.norm(truth.pad_force[:2])))
    normal, shear = np.abs(np.median(readings, axis=0))
    assert normal < 0.06 * 4.0 and shear < 0.15 * 0.98, (normal, shear)

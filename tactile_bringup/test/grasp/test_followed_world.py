# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""FollowedWorld feels the forces of the simulator whose states it is given."""
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_bringup.grasp.objects import OBJECTS, PADS, closing_width
from tactile_driver.simulation.skin.tools import Pose

mujoco = pytest.importorskip('mujoco', reason='MuJoCo is an optional extra: pip install mujoco')

from tactile_bringup.grasp.constants import GRASP  # noqa: E402
from tactile_bringup.grasp.followed_world import JOINTS, FollowedWorld, GripperState, simulator_text  # noqa: E402


class Simulator:
    """Steps the model of simulator_text as mujoco_ros2_control does, with a gripper controller that limits its force."""

    def __init__(self, held, pad):
        self.model = mujoco.MjModel.from_xml_string(simulator_text(held, pad))
        self.data = mujoco.MjData(self.model)
        self._goal = closing_width(held) + 0.04

    def step(self, max_force, height):
        finger = self.data.joint('left_finger_joint').qpos[0]
        self.data.actuator('grip').ctrl = np.clip(1000.0 * (self._goal - finger), -max_force, max_force)
        self.data.actuator('lift').ctrl = height
        mujoco.mj_step(self.model, self.data)

    def state(self):
        data = self.data
        joints = {name: (data.joint(name).qpos[0], data.joint(name).qvel[0], data.qfrc_actuator[self.model.joint(name).dofadr[0]])
                  for name in JOINTS}
        quaternion = np.roll(data.sensor('object_quat').data, -1)
        return GripperState(data.time, joints, Pose(data.sensor('object_pos').data.copy(), Rotation.from_quat(quaternion).as_matrix()))

    def force_on(self, side):
        """(3,) N, of the object on a finger, in the finger's axes."""
        body, held = self.model.body(side).id, self.model.body('object').id
        total, single = np.zeros(3), np.zeros(6)
        for number, contact in enumerate(self.data.contact):
            bodies = [self.model.geom_bodyid[geom] for geom in (contact.geom1, contact.geom2)]
            if sorted(bodies) == sorted((body, held)):
                mujoco.mj_contactForce(self.model, self.data, number, single)
                total += (1 if bodies[1] == body else -1) * single[:3] @ contact.frame.reshape(3, 3)
        return total @ self.data.xmat[body].reshape(3, 3)


@pytest.mark.parametrize('name', ['box', 'egg', 'soft_ball'])
@pytest.mark.parametrize('pad', list(PADS))
def test_forces_on_the_pads_are_those_of_the_simulator(name, pad):
    held = OBJECTS[name]
    simulator, followed = Simulator(held, pad), FollowedWorld(held, pad)
    errors = []
    for number in range(1500):
        time_s = number * simulator.model.opt.timestep
        share = np.clip(time_s - 1.4, 0.0, 1.0)
        simulator.step(2.0 if time_s < 0.8 else 8.0, 0.1 * share * share * (3 - 2 * share))
        if number % 2 or number % 5 == 4:
            followed.take(simulator.state())
        if number % 5 == 4:  # of the array
            load, truth = followed.advance()
            left, right = (simulator.force_on(side) for side in ('left', 'right'))
            if time_s > 0.8:
                errors.append([truth.grip_force + left[2], truth.shear_force - math.hypot(*left[:2]), *(truth.pad_force - right)])
    assert truth.is_held and truth.grip_force == pytest.approx(8.0, rel=0.02)
    borne = load.sum() * GRASP.taxel_pitch**2 if pad == 'array' else -load[:, 2].sum()
    assert borne == pytest.approx(truth.grip_force, rel=0.05), 'by the array or the domes'
    assert simulator.data.body('object').xpos[2] > 0.09, 'the object is lifted'
    # Forces between domes are indeterminate: 0.065 N along the fingers, while the box is lifted.
    limit = 0.07 if pad == 'force_taxels' else 0.05
    assert np.sqrt(np.mean(np.square(errors), axis=0)) == pytest.approx(0.0, abs=limit)


def test_time_that_begins_again_is_followed():
    """A simulation that is reset."""
    held = OBJECTS['box']
    simulator, followed = Simulator(held, 'array'), FollowedWorld(held, 'array')
    for _ in range(100):
        simulator.step(2.0, 0.0)
    followed.take(simulator.state())
    assert followed.advance()[1].time_s == pytest.approx(0.2)
    again = Simulator(held, 'array')
    again.step(2.0, 0.0)
    followed.take(again.state())
    _, truth = followed.advance()
    assert truth.time_s == pytest.approx(again.data.time) and not truth.is_held and np.isfinite(truth.object_pose.origin).all()


def test_the_end_lets_a_waiting_thread_go():
    followed = FollowedWorld(OBJECTS['box'], 'array')
    followed.end()
    load, truth = followed.advance()
    assert not load.any() and not truth.is_held

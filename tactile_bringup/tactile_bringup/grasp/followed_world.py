# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The gripper for a simulator with ros2_control (mujoco_ros2_control), and what its pads feel, by the states that the simulator publishes.

The simulator publishes joints and poses, but neither MuJoCo's tactile sensor nor contact forces. A second model is put into each state
without a step: MuJoCo then solves the same contacts again.
"""
from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from tactile_driver.simulation.skin.tools import Pose

from .constants import GRASP
from .objects import HeldObject
from .world import GraspTruth, GraspWorld, model_text, mujoco

LIFT_JOINT, FINGER_JOINT = 'lift_joint', 'left_finger_joint'
JOINTS = LIFT_JOINT, FINGER_JOINT, 'right_finger_joint'
OBJECT_SENSOR = 'object'  # prefix of the sensors of the object's position and orientation in the hand
_SOONER = 0.25 * GRASP.frame_s  # by which a state may come before the frame is due: the simulator's cycles are not the frames


def simulator_text(held: HeldObject, pad: str) -> str:
    """The model (MJCF) for the simulator: the wrist is a joint with a drive, the object's pose in the hand is measured."""
    root = _with_wrist_joint(held, pad)
    for parent, child in (('sensor', 'tactile'), ('asset', 'mesh'), (".//body[@name='left']", "geom[@name='array']")):
        root.find(parent).remove(root.find(parent).find(child))
    actuators, sensors = root.find('actuator'), root.find('sensor')
    ElementTree.SubElement(actuators, 'position', name='lift', joint=LIFT_JOINT, kp=str(GRASP.lift_stiffness), dampratio='1')
    of_object = {'objtype': 'xbody', 'objname': 'object', 'reftype': 'xbody', 'refname': 'hand'}
    for kind, suffix in (('framepos', 'pos'), ('framequat', 'quat')):
        ElementTree.SubElement(sensors, kind, name=f'{OBJECT_SENSOR}_{suffix}', **of_object)
    return ElementTree.tostring(root, encoding='unicode')


def _with_wrist_joint(held: HeldObject, pad: str) -> ElementTree.Element:
    """The gripper's model, in which a joint moves the wrist instead of a body that is set from outside."""
    root = ElementTree.fromstring(model_text(held, pad))
    world, equality = root.find('worldbody'), root.find('equality')
    hand = world.find("body[@name='hand']")
    world.remove(world.find("body[@name='wrist']"))
    equality.remove(equality.find('weld'))
    hand.remove(hand.find('freejoint'))
    hand.insert(0, ElementTree.Element('joint', name=LIFT_JOINT, type='slide', axis='0 0 1'))
    return root


@dataclass(frozen=True)
class GripperState:
    """What the simulator publishes of a moment.

    Attributes
    ----------
    time_s : float
    joints : mapping
        Name -> (position in m, velocity in m/s, force of the drive in N), of JOINTS.
    held : Pose
        Of the object in the hand's frame, m.
    """

    time_s: float
    joints: Mapping[str, tuple[float, float, float]]
    held: Pose


class FollowedWorld(GraspWorld):
    """The gripper in the states of a simulator that steps elsewhere; `take` is called by another thread.

    Its least force is that of the object's weight alone: forces on the object are not published.
    """

    def __init__(self, held: HeldObject, pad: str):
        super().__init__(held, pad=pad)
        self._model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)  # replaced by the published forces of the drives
        self._addresses = {name: (self._model.joint(name).qposadr[0], self._model.joint(name).dofadr[0]) for name in JOINTS}
        self._object_address = self._model.joint(self._model.body_jntadr[self._object]).qposadr[0]
        self._earlier: GripperState | None = None
        self._state: GripperState | None = None
        self._fresh, self._has_ended = threading.Condition(), False
        mujoco.mj_forward(self._model, self._data)

    def _text(self, pad: str) -> str:
        return ElementTree.tostring(_with_wrist_joint(self.held, pad), encoding='unicode')

    def take(self, state: GripperState) -> None:
        """The newest state."""
        with self._fresh:
            self._earlier, self._state = self._state, state
            self._fresh.notify()

    def end(self) -> None:
        """Let `advance` wait no more."""
        with self._fresh:
            self._has_ended = True
            self._fresh.notify()

    def advance(self, force: float = 0.0) -> tuple[np.ndarray, GraspTruth]:
        """Wait until the simulator has come to the next frame; the force has no effect. Returns what `GraspWorld.advance` returns."""
        with self._fresh:
            self._fresh.wait_for(lambda: self._has_ended or (
                self._state is not None and abs(self._state.time_s - self.time_s) >= GRASP.frame_s - _SOONER))
            before, state = self._earlier, self._state
        if state is not None and not self._has_ended:
            self._put(before or state, state)
        return self._read()

    def _positions(self, state: GripperState) -> np.ndarray:
        """Put the model's positions into a state, and return a copy."""
        data, start = self._data, self._object_address
        for name, (position, _) in self._addresses.items():
            data.qpos[position] = state.joints[name][0]
        mujoco.mj_kinematics(self._model, data)
        data.qpos[start:start + 3] = data.xpos[self._hand] + state.held.origin
        data.qpos[start + 3:start + 7] = np.roll(Rotation.from_matrix(state.held.turn).as_quat(), 1)
        return data.qpos.copy()

    def _put(self, before: GripperState, state: GripperState) -> None:
        """Into a state; the velocity of the object is that since the state before."""
        data, passed_s = self._data, state.time_s - before.time_s
        first, last = self._positions(before), self._positions(state)
        data.qvel[:] = 0.0
        if passed_s > 0:
            mujoco.mj_differentiatePos(self._model, data.qvel, passed_s, first, last)
        for name, (_, number) in self._addresses.items():
            data.qvel[number], data.qfrc_applied[number] = state.joints[name][1:]
        mujoco.mj_forward(self._model, data)
        self.time_s = state.time_s

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A parallel gripper, its wrist and an object in MuJoCo, which computes contacts and friction. One finger bears a pressure array."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tactile_driver.errors import BadArgument

from .objects import GRAVITY, LIFT_HEIGHT, LIFT_S, Disturbance, HeldObject

try:
    import mujoco
except ImportError:
    mujoco = None

TAXELS, PITCH = 44, 1e-3  # on a side; m
STEP_S = 0.002  # of the engine; contacts with a time constant of 6 ms need three steps or more in it
FRAME_S = 0.01  # between two frames of the array
_HALF_PAD, _PAD_DEPTH = 0.022, 0.003  # m; the pad is as large as the array
_FINGER_MASS = 0.05  # kg
_DAMPING = 40.0  # N s/m of the fingers' drive: it closes by 25 mm/s at 1 N
_SPREAD = 0.75  # taxels, standard deviation with which the pad's cover spreads a load
_OPENING = 0.01  # m from each pad to the object at the start
_LOWEST = 0.024  # m from the table to the middle of the pads, which end above the table

_MODEL = """
<mujoco>
  <option timestep="{step}" cone="elliptic" impratio="100" integrator="implicitfast" gravity="0 0 -{gravity}"/>
  <asset><mesh name="taxels" vertex="{vertices}" face="{faces}" inertia="shell"/></asset>
  <default><default class="pad">
    <geom type="box" size="{half} {half} {depth}" pos="0 0 -{depth}" mass="{finger}" friction="{friction} 0.003 0.0001" condim="4"
          solref="{softness} 1" solimp="0.5 0.95 0.0005" priority="1"/>
  </default></default>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1"/>
    <body name="wrist" mocap="true" pos="0 0 {start}"/>
    <body name="hand" pos="0 0 {start}">
      <freejoint/>
      <inertial pos="0 0 0.05" mass="1" diaginertia="0.002 0.002 0.002"/>
      <body name="left" pos="-{apart} 0 0" xyaxes="0 1 0 0 0 1">
        <joint name="left_finger_joint" type="slide" axis="0 0 1" damping="{damping}" range="-0.02 {apart}" limited="true"/>
        <geom name="left_pad" class="pad"/>
        <geom name="array" type="mesh" mesh="taxels" contype="0" conaffinity="0" mass="0"/>
      </body>
      <body name="right" pos="{apart} 0 0" xyaxes="0 -1 0 0 0 1">
        <joint name="right_finger_joint" type="slide" axis="0 0 1" damping="{damping}" range="-0.02 {apart}" limited="true"/>
        <geom name="right_pad" class="pad"/>
      </body>
    </body>
    <body name="object" pos="0 0 {height}">
      <freejoint/>
      <geom name="object" type="{shape}" size="{size}" mass="{mass}"/>
    </body>
  </worldbody>
  <equality>
    <weld body1="wrist" body2="hand" solref="0.004 1"/>
    <joint joint1="left_finger_joint" joint2="right_finger_joint" solref="0.004 1"/>
  </equality>
  <actuator><motor name="grip" joint="left_finger_joint" gear="2"/></actuator>
  <sensor><tactile name="taxels" geom="array" mesh="taxels"/></sensor>
</mujoco>
"""


@dataclass(frozen=True)
class GraspTruth:
    """What the engine knows of a moment.

    Attributes
    ----------
    time_s : float
    grip_force : float
        Normal force on the pad with the array, N.
    shear_force : float
        Friction force on that pad, N.
    displacement : ndarray, shape (3,)
        Of the object in the hand's axes since the lift began, m; NaN before.
    velocity : ndarray, shape (3,)
        Of the object relative to the hand, m/s.
    least_force : float
        Grip force below which friction cannot hold the present load of the object, N.
    is_held : bool
        Whether both pads touch the object.
    """

    time_s: float
    grip_force: float
    shear_force: float
    displacement: np.ndarray
    velocity: np.ndarray
    least_force: float
    is_held: bool


class GraspWorld:
    """Steps the engine by one frame of the array at a time.

    Parameters
    ----------
    held : HeldObject
        What stands between the fingers.
    disturbances : sequence of Disturbance
        What happens to it.

    Raises
    ------
    BadArgument
        If MuJoCo is not installed.
    """

    def __init__(self, held: HeldObject, disturbances: Sequence[Disturbance] = ()):
        if mujoco is None:
            raise BadArgument('the simulated gripper needs MuJoCo, an optional extra: pip install mujoco')
        self.held, self._disturbances = held, tuple(disturbances)
        self._start = max(held.half_height, _LOWEST)
        vertices, faces = _grid()
        self._model = mujoco.MjModel.from_xml_string(_MODEL.format(
            step=STEP_S, gravity=GRAVITY, vertices=vertices, faces=faces, half=_HALF_PAD, depth=_PAD_DEPTH, finger=_FINGER_MASS,
            friction=held.friction, softness=held.softness, start=self._start, apart=held.half_width + _OPENING, damping=_DAMPING,
            height=held.half_height, shape=held.shape, size=' '.join(map(str, held.size)), mass=held.mass))
        self._data = mujoco.MjData(self._model)
        self._hand, self._object = (self._model.body(name).id for name in ('hand', 'object'))
        self._pads = [self._model.geom(name).id for name in ('left_pad', 'right_pad')]
        self._geom = self._model.geom('object').id
        self._wrist = np.zeros((2, 3))  # displacement, m, and velocity, m/s, by which disturbances move the wrist
        self._grasped_at = np.full(3, np.nan)
        self._before = np.zeros(3)
        self.time_s, self._lift_s = 0.0, np.inf

    @property
    def closed_at(self) -> float:
        """Position of the finger joints at which the pads would meet, m."""
        return self.held.half_width + _OPENING

    @property
    def opening(self) -> float:
        """Position of the finger joints, m; each finger moves inwards by it."""
        return float(self._data.joint('left_finger_joint').qpos[0])

    def lift(self) -> None:
        """Begin to lift the object; the times of the disturbances count from now."""
        self._lift_s = self.time_s

    @property
    def lifted_s(self) -> float:
        """Time since the lift began, s; negative before."""
        return self.time_s - self._lift_s

    def advance(self, force: float) -> tuple[np.ndarray, GraspTruth]:
        """Press each finger inwards with a force, N (negative: open), until the next frame.

        Returns
        -------
        pressure : ndarray, shape (TAXELS, TAXELS)
            On each taxel, Pa; x along columns, y along rows, in the array's sensor frame.
        truth : GraspTruth
        """
        for _ in range(round(FRAME_S / STEP_S)):
            self._move_wrist()
            self._data.ctrl[0] = force
            self._data.xfrc_applied[self._object, :3] = self._applied() * self.held.mass * GRAVITY
            mujoco.mj_step(self._model, self._data)
            self.time_s += STEP_S
        return self._pressure(), self._truth()

    def _move_wrist(self) -> None:
        self._wrist[1] += self._wrist_acceleration() * STEP_S
        self._wrist[0] += self._wrist[1] * STEP_S
        share = np.clip(self.lifted_s / LIFT_S, 0.0, 1.0)
        height = self._start + LIFT_HEIGHT * share * share * (3 - 2 * share)
        self._data.mocap_pos[0] = self._wrist[0] + [0.0, 0.0, height]

    def _applied(self) -> np.ndarray:
        """Force on the object, (3,), in units of its weight."""
        return np.sum([d.force_at(self.lifted_s) for d in self._disturbances] or [np.zeros(3)], axis=0)

    def _pad_force(self, pad: int) -> np.ndarray:
        """Normal and friction force of the object on a pad, N."""
        total, single = np.zeros(3), np.zeros(6)
        for number in range(self._data.ncon):
            contact = self._data.contact[number]
            if {contact.geom1, contact.geom2} == {pad, self._geom}:
                mujoco.mj_contactForce(self._model, self._data, number, single)
                total += single[0] * contact.frame[:3] + single[1] * contact.frame[3:6] + single[2] * contact.frame[6:]
        axis = self._data.geom(pad).xmat.reshape(3, 3)[:, 2]
        normal = float(total @ axis)
        return np.array([abs(normal), np.linalg.norm(total - normal * axis)])

    def _pressure(self) -> np.ndarray:
        """The engine's normal force, shared between the taxels by how deep each is in the object, and spread by the pad's cover."""
        depth = self._data.sensordata[:TAXELS * TAXELS].reshape(TAXELS, TAXELS)
        if not depth.any():
            return np.zeros((TAXELS, TAXELS))
        pressure = depth * (self._pad_force(self._pads[0])[0] / (depth.sum() * PITCH**2))
        return cv2.GaussianBlur(pressure, (0, 0), _SPREAD, borderType=cv2.BORDER_CONSTANT)

    def _truth(self) -> GraspTruth:
        data = self._data
        rotation = data.xmat[self._hand].reshape(3, 3)
        relative = rotation.T @ (data.xpos[self._object] - data.xpos[self._hand])
        if self.lifted_s >= 0 and np.isnan(self._grasped_at).any():
            self._grasped_at = relative
        velocity, self._before = (relative - self._before) / FRAME_S, relative
        (normal, shear), (other, _) = (self._pad_force(pad) for pad in self._pads)
        load = self.held.mass * (np.array([0.0, 0.0, GRAVITY]) - self._applied() * GRAVITY + self._wrist_acceleration())
        return GraspTruth(self.time_s, float(normal), float(shear), relative - self._grasped_at, velocity,
                          float(np.linalg.norm(load)) / (2 * self.held.friction), bool(normal > 0 and other > 0))

    def _wrist_acceleration(self) -> np.ndarray:
        return np.sum([d.acceleration for d in self._disturbances if d.begin_s <= self.lifted_s < d.end_s] or [np.zeros(3)], axis=0)


def _grid() -> tuple[str, str]:
    """Vertices and faces of a mesh with a vertex in the middle of each taxel, as MuJoCo's texts."""
    middle = (np.arange(TAXELS) - (TAXELS - 1) / 2) * PITCH
    y, x = np.meshgrid(middle, middle, indexing='ij')
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    corner = (np.arange(TAXELS - 1)[:, None] * TAXELS + np.arange(TAXELS - 1)).ravel()
    faces = np.concatenate([np.column_stack([corner, corner + 1, corner + TAXELS]),
                            np.column_stack([corner + 1, corner + TAXELS + 1, corner + TAXELS])])
    return ' '.join(f'{value:.5f}' for value in vertices.ravel()), ' '.join(map(str, faces.ravel()))

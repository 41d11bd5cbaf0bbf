# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A parallel gripper, its wrist and an object in MuJoCo, which computes contacts and friction. One finger bears a pressure array, or domes
whose forces are measured."""
from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.skin.tools import Pose

from .constants import GRASP
from .objects import DOMED_PAD, FLAT_PAD, Disturbance, HeldObject, closing_width

try:
    import mujoco
except ImportError:
    mujoco = None


# Friction: with an impratio of 100 alone a held object creeps by 0.04 to 0.1 mm/s at any grip, up to 0.75 mm in a grasp, which Coulomb's
# friction does not. With 1000 and three noslip iterations it creeps by less than 0.001 mm/s, and the engine takes as long.
_MODEL = """
<mujoco>
  <option timestep="{step}" cone="elliptic" impratio="1000" noslip_iterations="3" integrator="implicitfast" gravity="0 0 -{gravity}"/>
  <visual><headlight ambient="0.45 0.45 0.45" diffuse="0.5 0.5 0.5" specular="0 0 0"/></visual>
  <asset><texture type="skybox" builtin="flat" rgb1="0.93 0.94 0.96" rgb2="0.93 0.94 0.96" width="8" height="8"/>
    <mesh name="taxels" vertex="{vertices}" face="{faces}" inertia="shell"/></asset>
  <default><default class="pad">
    <geom type="box" size="{half} {half} {depth}" pos="0 0 -{depth}" mass="{finger}" friction="{friction} 0.003 0.0001" condim="4"
          rgba="0.25 0.35 0.6 1" solref="{softness} 1" solimp="0.5 0.95 0.0005" priority="1"/>
    <default class="dome"><geom type="sphere" size="{dome}" mass="0" rgba="0.2 0.2 0.2 1"/></default>
  </default></default>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1" rgba="0.75 0.76 0.78 1"/>
    <body name="wrist" mocap="true" pos="0 0 {start}"/>
    <body name="hand" pos="0 0 {start}">
      <freejoint/>
      <inertial pos="0 0 0.05" mass="1" diaginertia="0.002 0.002 0.002"/>
      <body name="left" pos="-{apart} 0 0" xyaxes="0 1 0 0 0 1">
        <joint name="left_finger_joint" type="slide" axis="0 0 1" damping="{damping}" range="-0.02 {apart}" limited="true"/>
        {left}
        <geom name="array" type="mesh" mesh="taxels" contype="0" conaffinity="0" mass="0"/>
      </body>
      <body name="right" pos="{apart} 0 0" xyaxes="0 -1 0 0 0 1">
        <joint name="right_finger_joint" type="slide" axis="0 0 1" damping="{damping}" range="-0.02 {apart}" limited="true"/>
        <geom name="right_pad" class="pad"/>
      </body>
    </body>
    <body name="object" pos="0 0 {height}">
      <freejoint/>
      <geom name="object" type="{shape}" size="{size}" mass="{mass}" rgba="0.9 0.6 0.2 1"/>
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
    object_pose : Pose
        Of the object's centre in the frame of the right pad, z from its face to the object.
    pad_force : ndarray, shape (3,)
        Of the object on the right pad, N, in this frame.
    held : Pose
        Of the object's centre in the hand's frame.
    pads : tuple of Pose
        Of the faces of the left and the right pad in the hand's frame, z to the object.
    array_wrench : ndarray, shape (6,)
        Of the object on the left pad, N and N m, in the array's frame.
    """

    time_s: float
    grip_force: float
    shear_force: float
    displacement: np.ndarray
    velocity: np.ndarray
    least_force: float
    is_held: bool
    object_pose: Pose
    pad_force: np.ndarray
    held: Pose
    pads: tuple[Pose, Pose]
    array_wrench: np.ndarray


class GraspWorld:
    """Steps the engine by one frame of the array at a time.

    Parameters
    ----------
    held : HeldObject
        What stands between the fingers.
    disturbances : sequence of Disturbance
        What happens to it.
    pad : str
        Of the left finger: one of PADS.

    Raises
    ------
    BadArgument
        If MuJoCo is not installed.
    """

    def __init__(self, held: HeldObject, disturbances: Sequence[Disturbance] = (), pad: str = FLAT_PAD):
        if mujoco is None:
            raise BadArgument('the simulated gripper needs MuJoCo, an optional extra: pip install mujoco')
        self.held, self._disturbances = held, tuple(disturbances)
        self._start, self.has_domes = start_height(held), pad == DOMED_PAD
        self._model = mujoco.MjModel.from_xml_string(self._text(pad))
        self._data = mujoco.MjData(self._model)
        self._hand, self._object = (self._model.body(name).id for name in ('hand', 'object'))
        self._pads = [self._model.geom(name).id for name in ('left_pad', 'right_pad')]
        self._geom = self._model.geom('object').id
        self._domes = {self._model.geom(f'dome{number}').id: number for number in range(GRASP.domes**2)} if self.has_domes else {}
        self._wrist = np.zeros((2, 3))  # displacement, m, and velocity, m/s, by which disturbances move the wrist
        self._grasped_at = np.full(3, np.nan)
        self._before, self._renderer = np.zeros(3), None
        self.time_s, self._lift_s = 0.0, np.inf

    def _text(self, pad: str) -> str:
        return model_text(self.held, pad)

    @property
    def closed_at(self) -> float:
        """Position of the finger joints at which the pads would meet, m."""
        return closing_width(self.held)

    @property
    def opening(self) -> float:
        """Position of the finger joints, m; each finger moves inwards by it."""
        return float(self._data.joint('left_finger_joint').qpos[0])

    def lift(self) -> None:
        """Begin to lift the object; the times of the disturbances count from now."""
        self._lift_s = self.time_s

    def draw(self, width: int, height: int) -> np.ndarray:
        """An image (height, width, 3), BGR, of the gripper from the side. Raises BadArgument where MuJoCo cannot draw."""
        if self._renderer is None:
            try:
                self._renderer = mujoco.Renderer(self._model, height, width)
            except Exception as error:  # of the platform's library
                raise BadArgument(f'MuJoCo cannot draw here: {error}; install OpenGL, and set MUJOCO_GL to egl or osmesa') from error
        camera = mujoco.MjvCamera()
        camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (0.0, 0.0, 0.085), 0.27, 115.0, -18.0
        self._renderer.update_scene(self._data, camera)
        return np.ascontiguousarray(self._renderer.render()[..., ::-1])

    def turn(self, rotation_vector: np.ndarray) -> None:
        """Turn the wrist to an orientation, a rotation vector (3,), rad, from the upright one, at once: move it in small steps."""
        angle = float(np.linalg.norm(rotation_vector))
        axis = rotation_vector / angle if angle else np.zeros(3)
        self._data.mocap_quat[0] = [np.cos(0.5 * angle), *(np.sin(0.5 * angle) * axis)]

    @property
    def lifted_s(self) -> float:
        """Time since the lift began, s; negative before."""
        return self.time_s - self._lift_s

    def advance(self, force: float) -> tuple[np.ndarray, GraspTruth]:
        """Press each finger inwards with a force, N (negative: open), until the next frame.

        Returns
        -------
        load : ndarray, shape (GRASP.taxels, GRASP.taxels) or (GRASP.domes**2, 3)
            Pressure on each taxel of the array, Pa; x along columns, y along rows, in the array's sensor frame. Of domes the force of the
            object on each, N, in the same frame.
        truth : GraspTruth
        """
        steps = round(GRASP.frame_s / GRASP.engine_step_s)
        for step in range(steps):
            self._enable_sensor(step == steps - 1)
            self._move_wrist()
            self._data.ctrl[0] = force
            self._data.xfrc_applied[self._object, :3] = self._applied() * self.held.mass * GRASP.gravity
            mujoco.mj_step(self._model, self._data)
            self.time_s += GRASP.engine_step_s
        return self._read()

    def _read(self) -> tuple[np.ndarray, GraspTruth]:
        """What `advance` returns, of the present state."""
        left, right = (self._wrench_on(pad) for pad in self._pads)
        load = self._dome_forces() if self.has_domes else self._pressure(-left[2])
        return load, self._truth(left, right)

    def _enable_sensor(self, enabled: bool) -> None:
        flag = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self._model.opt.disableflags = self._model.opt.disableflags & ~flag if enabled else self._model.opt.disableflags | flag

    def _move_wrist(self) -> None:
        self._wrist[1] += self._wrist_acceleration() * GRASP.engine_step_s
        self._wrist[0] += self._wrist[1] * GRASP.engine_step_s
        share = np.clip(self.lifted_s / GRASP.lift_s, 0.0, 1.0)
        height = self._start + GRASP.lift_height * share * share * (3 - 2 * share)
        self._data.mocap_pos[0] = self._wrist[0] + [0.0, 0.0, height]

    def _applied(self) -> np.ndarray:
        """Force on the object, (3,), in units of its weight."""
        return np.sum([d.force_at(self.lifted_s) for d in self._disturbances] or [np.zeros(3)], axis=0)

    def _contacts_with(self, geoms: Collection[int]) -> Iterator[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
        """(geometry, position in m, force in N, moment in N m) of each contact of the object with some geometries, in the world."""
        single = np.zeros(6)
        for number in range(self._data.ncon):
            contact = self._data.contact[number]
            geom = contact.geom1 if contact.geom2 == self._geom else contact.geom2
            if self._geom in (contact.geom1, contact.geom2) and geom in geoms:
                mujoco.mj_contactForce(self._model, self._data, number, single)
                sign = 1 if contact.geom2 == geom else -1  # the engine's force acts on the second
                yield geom, contact.pos, *(sign * part @ contact.frame.reshape(3, 3) for part in (single[:3], single[3:]))

    def _wrench_on(self, pad: int) -> np.ndarray:
        """(6,) N and N m of the object on a pad, at the middle of its face and in its frame."""
        total, geom = np.zeros(6), self._data.geom(pad)
        axes = geom.xmat.reshape(3, 3)
        face = geom.xpos + axes @ [0.0, 0.0, GRASP.pad_depth]
        for _, position, force, moment in self._contacts_with(self._domes if self._domes and pad == self._pads[0] else (pad,)):
            total += np.concatenate([force, moment + np.cross(position - face, force)])
        return np.concatenate([total[:3] @ axes, total[3:] @ axes])

    def _dome_forces(self) -> np.ndarray:
        """(GRASP.domes**2, 3) N, of the object on each dome, in the frame of the left pad."""
        forces = np.zeros((GRASP.domes**2, 3))
        for geom, _, force, _ in self._contacts_with(self._domes):
            forces[self._domes[geom]] += force
        return forces @ self._data.geom(self._pads[0]).xmat.reshape(3, 3)

    def _pressure(self, force: float) -> np.ndarray:
        """The engine's normal force, N, shared between the taxels by how deep each is in the object, and spread by the pad's cover."""
        shape = 2 * (GRASP.taxels, GRASP.taxel_samples)
        samples = self._data.sensordata[:math.prod(shape)].reshape(shape)
        depth = samples.mean(axis=(1, 3))
        if not depth.any():
            return np.zeros((GRASP.taxels, GRASP.taxels))
        pressure = depth * (force / (depth.sum() * GRASP.taxel_pitch**2))
        return cv2.GaussianBlur(pressure, (0, 0), GRASP.pad_spread, borderType=cv2.BORDER_CONSTANT)

    def _truth(self, left: np.ndarray, right: np.ndarray) -> GraspTruth:
        """left, right: (6,) N and N m, on the pads, each in the frame of its pad."""
        data = self._data
        rotation = data.xmat[self._hand].reshape(3, 3)
        relative = rotation.T @ (data.xpos[self._object] - data.xpos[self._hand])
        if self.lifted_s >= 0 and np.isnan(self._grasped_at).any():
            self._grasped_at = relative
        velocity, self._before = (relative - self._before) / GRASP.frame_s, relative
        load = self.held.mass * (np.array([0.0, 0.0, GRASP.gravity]) - self._applied() * GRASP.gravity + self._wrist_acceleration())
        held = Pose(relative, rotation.T @ data.xmat[self._object].reshape(3, 3))
        pads = tuple(self._face(pad, rotation) for pad in self._pads)
        face = pads[1]
        pose = Pose(face.turn.T @ (held.origin - face.origin), face.turn.T @ held.turn)
        return GraspTruth(self.time_s, float(-left[2]), float(np.linalg.norm(left[:2])), relative - self._grasped_at, velocity,
                          float(np.linalg.norm(load)) / (2 * self.held.friction), bool(left[2] < 0 and right[2] < 0), pose, right[:3],
                          held, pads, left)

    def _face(self, pad: int, rotation: np.ndarray) -> Pose:
        """Of a pad in the hand's frame, whose axes in the world are rotation (3, 3)."""
        geom = self._data.geom(pad)
        turn = rotation.T @ geom.xmat.reshape(3, 3)
        return Pose(rotation.T @ (geom.xpos - self._data.xpos[self._hand]) + turn @ [0.0, 0.0, GRASP.pad_depth], turn)

    def _wrist_acceleration(self) -> np.ndarray:
        return np.sum([d.acceleration for d in self._disturbances if d.begin_s <= self.lifted_s < d.end_s] or [np.zeros(3)], axis=0)


def start_height(held: HeldObject) -> float:
    """From the table to the middle of the pads before the lift, m."""
    return max(held.half_height, GRASP.min_pad_height)


def model_text(held: HeldObject, pad: str) -> str:
    """The model of MuJoCo (MJCF) of the gripper with an object; pad: of the left finger, one of PADS."""
    vertices, faces = _grid()
    return _MODEL.format(
        step=GRASP.engine_step_s, gravity=GRASP.gravity, vertices=vertices, faces=faces, half=GRASP.pad_half, depth=GRASP.pad_depth,
        finger=GRASP.finger_mass, friction=held.friction, softness=held.softness, start=start_height(held), apart=closing_width(held),
        damping=GRASP.finger_damping, height=held.half_height, shape=held.shape, size=' '.join(map(str, held.size)), mass=held.mass,
        dome=GRASP.dome_radius, left=_domes() if pad == DOMED_PAD else '<geom name="left_pad" class="pad"/>')


def _domes() -> str:
    """A pad that bears nothing itself, and domes on it whose tops are its face."""
    middle = (np.arange(GRASP.domes) - (GRASP.domes - 1) / 2) * GRASP.dome_pitch
    y, x = (each.ravel() for each in np.meshgrid(middle, middle, indexing='ij'))
    return '<geom name="left_pad" class="pad" contype="0" conaffinity="0"/>' + ''.join(
        f'<geom name="dome{number}" class="dome" pos="{x[number]:.6f} {y[number]:.6f} -{GRASP.dome_radius}"/>' for number in range(x.size))


def _grid() -> tuple[str, str]:
    """Vertices and faces of a mesh with GRASP.taxel_samples x GRASP.taxel_samples vertices evenly over each taxel, as MuJoCo's texts."""
    side = GRASP.taxels * GRASP.taxel_samples
    middle = (np.arange(side) - (side - 1) / 2) * GRASP.taxel_pitch / GRASP.taxel_samples
    y, x = np.meshgrid(middle, middle, indexing='ij')
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate([np.column_stack([corner, corner + 1, corner + side]),
                            np.column_stack([corner + 1, corner + side + 1, corner + side])])
    return ' '.join(f'{value:.6f}' for value in vertices.ravel()), ' '.join(map(str, faces.ravel()))

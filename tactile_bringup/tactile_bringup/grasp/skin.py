# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad on the gripper's right finger: a soft skin under the forces and the motion that the engine has computed for a rigid pad."""
from __future__ import annotations

from functools import partial

import numpy as np

from tactile_driver.frame import CameraCalibration, pinhole_calibration
from tactile_driver.simulation.optics.light import Lighting
from tactile_driver.simulation.optics.rendering import Imaging, Renderer
from tactile_driver.simulation.scene.observe import Observer
from tactile_driver.simulation.sensors.touchpad import touchpad_camera, touchpad_dots
from tactile_driver.simulation.skin.contact import FrictionalContact
from tactile_driver.simulation.skin.surfaces import Membrane
from tactile_driver.simulation.skin.tools import Pose, Tool
from tactile_driver.simulation.truth import SimulatedFrame

from .constants import GRASP
from .objects import HeldObject

APEX = Membrane().height  # m, of the untouched skin over the origin of the sensor frame
#: Of its perception: what the touchpad of the parameter file does not have.
PARAMETERS = {'membrane.shear_stiffness': GRASP.skin_tension, 'membrane.rest_pressure': 2 * GRASP.skin_tension / Membrane().radius}
# N/m, of the skin under a face of some 15 mm: no less than it is, so that its steps do not overshoot
_STIFFNESS = 20.0 * GRASP.skin_tension


def object_distance(held: HeldObject, p: np.ndarray) -> np.ndarray:
    """Signed distance (...), m, from points (..., 3), m, in the object's frame; of an ellipsoid to first order."""
    size = np.array(held.size)
    if held.shape == 'sphere':
        return np.sqrt((p**2).sum(axis=-1)) - size[0]
    if held.shape == 'ellipsoid':
        scaled = np.sqrt(((p / size)**2).sum(axis=-1))
        return scaled * (scaled - 1) / np.maximum(np.sqrt(((p / size**2)**2).sum(axis=-1)), 1e-9)
    if held.shape == 'cylinder':
        beyond = np.stack([np.hypot(p[..., 0], p[..., 1]) - size[0], np.abs(p[..., 2]) - size[1]], axis=-1) + GRASP.edge_radius
    else:
        beyond = np.abs(p) - size + GRASP.edge_radius
    return np.sqrt((np.maximum(beyond, 0)**2).sum(axis=-1)) + np.minimum(beyond.max(axis=-1), 0) - GRASP.edge_radius


class TouchpadFinger:
    """Draws what the camera behind the skin sees.

    The engine has a rigid pad. Where the object would be on a soft one follows from the skin itself: it yields until it bears the force
    that the engine's pad bears. The skin has its own friction, the coefficient of which is the engine's.

    Parameters
    ----------
    held : HeldObject
        The object.
    rate : float
        Frames per second.
    seed : int
        Of the irregularities of the dots and of the noise.
    """

    def __init__(self, held: HeldObject, rate: float, seed: int = 0):
        self.skin, self.camera = Membrane(tension=GRASP.skin_tension), touchpad_camera()
        self._pattern = touchpad_dots(self.skin, np.random.default_rng([seed, 0]))
        self._renderer = Renderer(self.skin, self.camera, Lighting(), Imaging(), seed)
        self._contact = FrictionalContact(self.skin, held.friction)
        self._observer = Observer(self.skin, self._pattern, self.camera, 1 / rate)
        self._tool = Tool('object', (partial(object_distance, held),), central=True)
        self._number = 0
        self._reset()

    @property
    def calibration(self) -> CameraCalibration:
        """Of its camera."""
        return pinhole_calibration(self.camera.matrix, self.camera.distortion, (self.camera.width, self.camera.height))

    @property
    def object_pose(self) -> Pose | None:
        """Of the object on the skin in the sensor frame, m; None where it does not touch."""
        return self._last

    def _reset(self) -> None:
        self._contact.reset()
        self._yields, self._last = np.zeros(3), None

    def advance(self, pose: Pose, force: np.ndarray) -> SimulatedFrame:
        """The next frame.

        Parameters
        ----------
        pose : Pose
            Of the object's centre in the frame of the rigid pad, m.
        force : ndarray, shape (3,)
            Of the object on the pad, N, in this frame.
        """
        self._number += 1
        if force[2] >= 0:
            self._reset()
            seen = self._observer.lifted()
        else:
            seen = self._press(pose, force)
        image = self._renderer.draw(seen.shape, seen.truth.dot_uv, seen.spread, self._pattern.radius, self._number)
        return SimulatedFrame(image, seen.truth)

    def _press(self, pose: Pose, force: np.ndarray):
        first = before = self._last or self._at(pose)
        for _ in range(GRASP.max_skin_steps):
            now = self._at(pose)
            self._contact.step(self._tool, before, now)
            missing = force - self._contact.state.force.sum(axis=0)
            before = now
            if np.linalg.norm(missing) < GRASP.force_tolerance * np.linalg.norm(force):
                break
            self._yields += np.clip(missing / _STIFFNESS, -GRASP.max_skin_step, GRASP.max_skin_step)
        self._last = now
        return self._observer.observe(self._contact.state, self._tool, first, now)

    def _at(self, pose: Pose) -> Pose:
        """The pose in the skin's frame."""
        return Pose(pose.origin + self._yields + [0.0, 0.0, APEX], pose.turn)

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated camera: a lens with Brown's distortion that looks through the pad from behind."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

#: Native resolution (px) for which the intrinsics below hold; a smaller picture is the same view, binned.
NATIVE_WIDTH, NATIVE_HEIGHT = 640, 480
_NATIVE_FOCAL = (688.0, 688.0)
_NATIVE_CENTRE = (321.3, 237.8)
_DISTORTION = (-0.062, 0.018, 4e-4, -3e-4, 0.0)
_MOUNT_TURN = (0.003, -0.004, 0.002)
_MOUNT_PLACE = (-0.00012, 0.00008, 0.0400)


@dataclass(frozen=True)
class SimulatedCamera:
    """Intrinsics and mounting of the simulated camera.

    matrix: (3, 3) K, px, pixel centres at whole numbers; distortion: (5,) k1 k2 p1 p2 k3; rotation: (3, 3) and translation: (3,), m, with
    x_camera = rotation @ x_sensor + translation; width, height: px.
    """

    matrix: np.ndarray
    distortion: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    width: int
    height: int

    @property
    def centre(self) -> np.ndarray:
        """(3,) centre of projection in the sensor frame, m."""
        return -self.rotation.T @ self.translation

    def project(self, xyz: np.ndarray) -> np.ndarray:
        """Image places (..., 2), px, of points (..., 3) in the sensor frame, m."""
        seen = xyz @ self.rotation.T + self.translation
        a, b = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = a * a + b * b
        swell = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent_a = a * swell + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
        bent_b = b * swell + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
        focal, centre = np.diag(self.matrix)[:2], self.matrix[:2, 2]
        return np.stack([focal[0] * bent_a + centre[0], focal[1] * bent_b + centre[1]], axis=-1)

    def rays(self, uv: np.ndarray) -> np.ndarray:
        """Unit vectors (N, 3) in the sensor frame through image places (N, 2), px."""
        plane = cv2.undistortPoints(np.asarray(uv, float).reshape(-1, 1, 2), self.matrix, self.distortion).reshape(-1, 2)
        rays = np.column_stack([plane, np.ones(len(plane))]) @ self.rotation
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def project_with_slope(self, xyz: np.ndarray, step: float = 1e-6) -> tuple[np.ndarray, np.ndarray]:
        """Image places (N, 2), px, of points (N, 3), m, and their slopes (N, 2, 3), px/m, by central differences of step m."""
        shifts = np.concatenate([np.zeros((1, 3)), step * np.eye(3), -step * np.eye(3)])
        uv = self.project(xyz[:, None, :] + shifts)
        return uv[:, 0], ((uv[:, 1:4] - uv[:, 4:7]) / (2 * step)).transpose(0, 2, 1)


def _turn(rotvec) -> np.ndarray:
    """(3, 3) rotation by the vector rotvec (3,), rad."""
    angle = np.linalg.norm(rotvec)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = np.asarray(rotvec) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def mounted_camera(width: int = NATIVE_WIDTH, height: int = NATIVE_HEIGHT) -> SimulatedCamera:
    """The touchpad's camera, 40 mm behind the rim, for pictures of width x height px (the field of view is kept along the width)."""
    scale_u, scale_v = width / NATIVE_WIDTH, height / NATIVE_HEIGHT
    # A binned pixel's centre lies half a small pixel further than the first small pixel's: (c + 1/2) scales, not c.
    centre = ((_NATIVE_CENTRE[0] + 0.5) * scale_u - 0.5, (_NATIVE_CENTRE[1] + 0.5) * scale_v - 0.5)
    matrix = np.array([[_NATIVE_FOCAL[0] * scale_u, 0, centre[0]], [0, _NATIVE_FOCAL[1] * scale_v, centre[1]], [0, 0, 1.0]])
    return SimulatedCamera(matrix, np.array(_DISTORTION), _turn(_MOUNT_TURN), np.array(_MOUNT_PLACE), width, height)

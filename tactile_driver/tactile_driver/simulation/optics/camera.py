# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated camera behind the skin: a pinhole with Brown's distortion."""
from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np


@dataclass(frozen=True)
class SimulatedCamera:
    """Intrinsic and extrinsic parameters of the simulated camera.

    matrix: (3, 3) K, px, pixel centres at whole numbers; distortion: (5,) k1 k2 p1 p2 k3; rotation: (3, 3) and translation: (3,), m, with
    x_camera = rotation @ x_sensor + translation; width, height: px;
    scale: width over the width of the native image; blur and similar values refer to the native image.
    """

    matrix: np.ndarray
    distortion: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    width: int
    height: int
    scale: float = 1.0

    @property
    def centre(self) -> np.ndarray:
        """(3,) centre of projection in the sensor frame, m."""
        return -self.rotation.T @ self.translation

    def project(self, xyz: np.ndarray) -> np.ndarray:
        """Pixels (..., 2) of points (..., 3), m, in the sensor frame."""
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
        """Unit ray directions (N, 3) in the sensor frame through pixels (N, 2)."""
        plane = cv2.undistortPoints(np.asarray(uv, float).reshape(-1, 1, 2), self.matrix, self.distortion).reshape(-1, 2)
        rays = np.column_stack([plane, np.ones(len(plane))]) @ self.rotation
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def project_with_slope(self, xyz: np.ndarray, step: float = 1e-6) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (N, 2) of points (N, 3), m, and the Jacobians (N, 2, 3), px/m, by central differences of step, m."""
        shifts = np.concatenate([np.zeros((1, 3)), step * np.eye(3), -step * np.eye(3)])
        uv = self.project(xyz[:, None, :] + shifts)
        return uv[:, 0], ((uv[:, 1:4] - uv[:, 4:7]) / (2 * step)).transpose(0, 2, 1)


@dataclass(frozen=True)
class CameraDesign:
    """A camera and its pose.

    focal, centre: (x, y), px of the native image; distortion: (k1, k2, p1, p2, k3); turn: rotation vector from the sensor frame to the
    camera frame, rad; position: translation, m; size: (width, height) of the native image, px.
    """

    focal: tuple[float, float]
    centre: tuple[float, float]
    distortion: tuple[float, ...]
    turn: tuple[float, float, float]
    position: tuple[float, float, float]
    size: tuple[int, int] = (640, 480)

    def mounted(self, width: int) -> SimulatedCamera:
        """The camera with images of width px and the field of view of the native size (binning)."""
        scale = width / self.size[0]
        # Pixel centres are at whole numbers, so binning scales c + 1/2, not c.
        u, v = ((c + 0.5) * scale - 0.5 for c in self.centre)
        matrix = np.array([[self.focal[0] * scale, 0, u], [0, self.focal[1] * scale, v], [0, 0, 1.0]])
        rotation = cv2.Rodrigues(np.asarray(self.turn, float))[0]
        return SimulatedCamera(matrix, np.array(self.distortion, float), rotation, np.array(self.position, float), width,
                               int(self.size[1] * scale), scale)

    def built(self, rng: np.random.Generator) -> CameraDesign:
        """A specimen, with random manufacturing tolerances."""
        focal = self.focal[0] * (1 + rng.normal(0, 0.004))
        return replace(self, focal=(focal, focal * (1 + rng.normal(0, 0.001))), centre=np.add(self.centre, rng.normal(0, 2.0, 2)),
                       turn=np.add(self.turn, rng.normal(0, 0.003, 3)), position=np.add(self.position, rng.normal(0, 0.15e-3, 3)))

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Pinhole camera: projection of points in the sensor frame, and rays through pixels."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from tactile_driver.lens import farthest_square
from tactile_perception._core.common import Camera

from ..core.errors import BadArgument


def _finite(name: str, value, shape: tuple) -> np.ndarray:
    array = np.asarray(value, float)
    if array.shape != shape or not np.isfinite(array).all():
        raise BadArgument(f'camera: {name} must be {shape} finite numbers, got {value!r}; check camera_info and the sensor parameters')
    return array


@dataclass
class CameraModel:
    """A pinhole camera with Brown distortion, placed in the sensor frame.

    matrix: (3, 3) K, px; distortion: (5,) k1 k2 p1 p2 k3; rotation: (3, 3) and translation: (3,) m, with
    x_camera = rotation @ x_sensor + translation. Raises BadArgument where a number is missing or not finite.
    """

    matrix: np.ndarray
    distortion: np.ndarray = field(default_factory=lambda: np.zeros(5))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    translation: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self):
        self.matrix = _finite('matrix', self.matrix, (3, 3))
        self.distortion = _finite('distortion', self.distortion, (5,))
        self.rotation = _finite('rotation', self.rotation, (3, 3))
        self.translation = _finite('translation', self.translation, (3,))
        if self.matrix[0, 0] <= 0 or self.matrix[1, 1] <= 0:
            raise BadArgument(f'camera: focal lengths must be positive, got {self.matrix[0, 0]}, {self.matrix[1, 1]}; check camera_info')
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=1e-6):
            raise BadArgument('camera: rotation is not a rotation matrix; check camera.rotation')

    @cached_property
    def centre(self) -> np.ndarray:
        """(3,) centre of projection in the sensor frame, m."""
        return -self.rotation.T @ self.translation

    @cached_property
    def kernel(self) -> Camera:
        """The same for the kernels."""
        return Camera(matrix=self.matrix, distortion=self.distortion, rotation=self.rotation, farthest=farthest_square(self.distortion))

    def project(self, xyz: np.ndarray) -> np.ndarray:
        """Image positions (N, 2), px, of points xyz (N, 3) in the sensor frame, m."""
        points = np.ascontiguousarray(xyz, float).reshape(-1, 1, 3)
        if not len(points):
            return np.zeros((0, 2))
        return cv2.projectPoints(points, cv2.Rodrigues(self.rotation)[0], self.translation, self.matrix, self.distortion)[0].reshape(-1, 2)

    def rays(self, uv: np.ndarray) -> np.ndarray:
        """Unit vectors (N, 3) in the sensor frame from the camera centre through uv (N, 2), px; NaN outside the lens' field of view."""
        return self.kernel.rays(np.asarray(uv, float))


def camera_pose(values: Mapping) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and translation (3,) m of the camera, x_camera = rotation @ x_sensor + translation. Raises BadArgument."""
    rotation, translation = (np.asarray(values[f'camera.{name}'], float) for name in ('rotation', 'translation'))
    if rotation.shape != (3,) or translation.shape != (3,):
        raise BadArgument('parameters camera.rotation and camera.translation must have three numbers each')
    return cv2.Rodrigues(rotation)[0], translation

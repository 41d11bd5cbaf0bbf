# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's geometry and material, from parameters."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..common.camera import CameraModel, camera_pose
from ..common.geometry import Cap
from ..errors import BadArgument
from .membrane import MembraneMaterial


@dataclass(frozen=True)
class Touchpad:
    """rows, columns: of the printed grid; cap: untouched shape; material: of the membrane;
    rotation (3, 3), translation (3,) m: x_camera = rotation @ x_sensor + translation."""

    rows: int
    columns: int
    cap: Cap
    material: MembraneMaterial
    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def from_parameters(cls, values: Mapping) -> Touchpad:
        """The sensor for values (of TOUCHPAD_SENSOR_PARAMETERS). Raises BadArgument for inconsistent values."""
        rotation, translation = camera_pose(values)
        cap = Cap(values['cap.curvature_radius'], values['cap.height'])
        if min(values['rows'], values['columns']) < 3:
            raise BadArgument(f'parameters rows and columns of a touchpad must be at least 3, not {values["rows"]} and {values["columns"]}')
        material = MembraneMaterial(values['membrane.shear_stiffness'], values['membrane.rest_pressure'], values['cap.curvature_radius'])
        return cls(values['rows'], values['columns'], cap, material, rotation, translation)

    def camera(self, matrix: np.ndarray, distortion: np.ndarray) -> CameraModel:
        """The camera with K (3, 3), distortion (5,) and its pose in the sensor."""
        return CameraModel(matrix, distortion, self.rotation, self.translation)

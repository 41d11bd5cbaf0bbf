# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The touchpad's geometry and material, from parameters."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..common.camera import CameraModel, camera_pose
from ..common.geometry import Cap
from ..core.errors import BadArgument
from .membrane import MembraneMaterial


@dataclass(frozen=True)
class Touchpad:
    """Geometry and material of a touchpad.

    Attributes
    ----------
    rows, columns : int
        Size of the printed grid.
    cap : Cap
        Undeformed surface.
    material : MembraneMaterial
        Material of the membrane.
    rotation : ndarray, shape (3, 3)
        Rotation R of x_camera = R @ x_sensor + t.
    translation : ndarray, shape (3,)
        Translation t in m.
    """

    rows: int
    columns: int
    cap: Cap
    material: MembraneMaterial
    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def from_parameters(cls, values: Mapping) -> Touchpad:
        """Make the sensor from parameters.

        Parameters
        ----------
        values : Mapping
            Values of TOUCHPAD_SENSOR_PARAMETERS.

        Returns
        -------
        Touchpad
            The sensor.

        Raises
        ------
        BadArgument
            If the values are inconsistent.
        """
        rotation, translation = camera_pose(values)
        cap = Cap(values['cap.curvature_radius'], values['cap.height'])
        if min(values['rows'], values['columns']) < 3:
            raise BadArgument(f'parameters rows and columns of a touchpad must be at least 3, not {values["rows"]} and {values["columns"]}')
        material = MembraneMaterial(values['membrane.shear_stiffness'], values['membrane.rest_pressure'], values['cap.curvature_radius'])
        return cls(values['rows'], values['columns'], cap, material, rotation, translation)

    def camera(self, matrix: np.ndarray, distortion: np.ndarray) -> CameraModel:
        """Make the camera model, with the pose of the camera in the sensor.

        Parameters
        ----------
        matrix : ndarray, shape (3, 3)
            Camera matrix K.
        distortion : ndarray, shape (5,)
            Distortion coefficients.

        Returns
        -------
        CameraModel
            The camera.
        """
        return CameraModel(matrix, distortion, self.rotation, self.translation)

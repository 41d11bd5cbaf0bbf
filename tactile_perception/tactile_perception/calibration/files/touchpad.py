# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Calibration of a touchpad as a file."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from ...common.camera import CameraModel
from ...common.geometry import Cap
from ...errors import BadArgument, BadCalibration
from .format import CalibrationFile, Specimen, read_calibration, write_calibration
from ..residuals import outliers
from ..touchpad import TouchpadCalibration
from ...touchpad.optics.absorption import WaterModel
from ...touchpad.optics.light_path import LightPath

SENSOR = 'touchpad'
UNITS = {'lengths': 'm', 'absorptions': '1/m', 'ring': 'px', 'image_size': 'px', 'constants': 'log ratio blue/red, green/red',
         'noise': 'variance of log ratios', 'scale_sigma': '1', 'camera_centre': 'm'}
NUMBERS = ('window_z', 'lamp_z', 'lamp_radius', 'ambient', 'ring', 'ring_offset', 'scale_sigma', 'offset_sigma',
           'curvature_radius', 'height')
ARRAYS = {'constants': (2,), 'absorptions': (2,), 'noise': (2, 2), 'camera_centre': (3,), 'image_size': (2,)}
POSITIVE = ('ring', 'absorptions', 'curvature_radius', 'height', 'scale_sigma', 'image_size')
POSE_TOLERANCE = 2e-4  # m, chosen: largest difference of the camera's position from that of the calibration


def write_touchpad(path: str | Path, calibration: TouchpadCalibration, image_size: tuple[int, int],
                   specimen: Specimen = Specimen()) -> None:
    """Write a calibration for images of image_size (width, height) px. Raises BadCalibration or OSError as write_calibration does."""
    model = calibration.model
    light = model.path
    values = {'window_z': light.window_z, 'lamp_z': light.lamp_z, 'lamp_radius': light.lamp_radius, 'ambient': light.ambient,
              'ring': model.ring, 'ring_offset': model.ring_offset, 'scale_sigma': model.scale_sigma, 'offset_sigma': model.offset_sigma,
              'curvature_radius': model.cap.curvature_radius, 'height': model.cap.height}
    fitted = {name: float(value) for name, value in values.items()}
    arrays = {'constants': model.constants, 'absorptions': model.absorptions, 'noise': model.noise, 'camera_centre': light.centre,
              'image_size': image_size}
    fitted |= {name: np.asarray(value).tolist() for name, value in arrays.items()}
    residuals = {'range_rms': calibration.residual_rms, 'range_bias': calibration.residual_bias,
                 'held_out_places_range_rms': calibration.held_out_rms,
                 'presses': calibration.presses, 'dots': calibration.dots, 'sphere_radius': calibration.sphere_radius}
    low, high = np.asarray(calibration.place_range, float).tolist()
    span = {'depth': [float(v) for v in calibration.depth_range], 'x': [low[0], high[0]], 'y': [low[1], high[1]]}
    write_calibration(path, CalibrationFile(
        SENSOR, UNITS, fitted, residuals, span, calibration.left_out, serial=specimen.serial, parameters=specimen.parameters(SENSOR),
        outliers=outliers(calibration.held_out)))


def read_touchpad(path: str | Path, camera: CameraModel, image_size: tuple[int, int] | None = None) -> WaterModel:
    """Read the model. Raises BadCalibration for a bad file (read_calibration), a number that is missing or must be positive and is not, and
    another camera position or image_size (width, height) px; None skips the check of the size.
    """
    fitted = read_calibration(path, SENSOR).fitted
    values = _check(fitted, path)
    if image_size is not None and tuple(fitted['image_size']) != tuple(image_size):
        raise BadCalibration(f'{path}: made for images of {fitted["image_size"]} px, these are {list(image_size)}; calibrate at this size')
    moved = float(np.linalg.norm(values['camera_centre'] - camera.centre))
    if moved > POSE_TOLERANCE:
        raise BadCalibration(f'{path}: the camera stood {moved * 1e3:.2f} mm from where the parameters put it; correct the pose '
                             'or calibrate again')
    light = LightPath(*(fitted[name] for name in ('window_z', 'lamp_z', 'lamp_radius', 'ambient')), tuple(values['camera_centre']))
    try:
        cap = Cap(fitted['curvature_radius'], fitted['height'])
        return WaterModel(light, values['constants'], values['absorptions'], values['noise'], fitted['ring'], cap,
                          fitted['ring_offset'], fitted['scale_sigma'], fitted['offset_sigma'])
    except BadArgument as error:
        raise BadCalibration(f'{path}: {error}') from None


def _check(fitted: dict, path) -> dict[str, np.ndarray]:
    """Arrays among the fitted numbers, after checking that all numbers exist, have their shapes, and are positive where required."""
    missing = [name for name in (*NUMBERS, *ARRAYS) if name not in fitted]
    if missing:
        raise BadCalibration(f'{path}: no {", ".join(missing)} under fitted; calibrate again')
    arrays = {name: np.asarray(fitted[name], float) for name in ARRAYS}
    for name, shape in ARRAYS.items():
        if arrays[name].shape != shape:
            raise BadCalibration(f'{path}: fitted.{name} has shape {arrays[name].shape}, not {shape}; calibrate again')
    for name in POSITIVE:
        if not (np.asarray(fitted[name]) > 0).all():
            raise BadCalibration(f'{path}: fitted.{name} is {fitted[name]}, must be positive; calibrate again')
    if not (np.linalg.eigvalsh(arrays['noise']) > 0).all():
        raise BadCalibration(f'{path}: fitted.noise is no covariance; calibrate again')
    return arrays

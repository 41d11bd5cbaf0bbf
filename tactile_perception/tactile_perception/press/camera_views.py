# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Factory of marker views from a sensor's camera calibration."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from tactile_driver.stitching.calibration import Stitching, stitching_from_dict

from ..common.camera import CameraModel
from .field import CameraView, MarkerView, StitchedView, camera_view
from .sensor import MarkerSensor


def view_maker(sensor: MarkerSensor, matrices: tuple[np.ndarray, np.ndarray] | None, stitching: Mapping | None,
               pose: tuple[np.ndarray, np.ndarray] | None = None) -> Callable[[np.ndarray], MarkerView] | None:
    """A function that makes the view from untouched positions (K, 2) px; None where the camera is not calibrated.

    matrices: K (3, 3) and distortion (5,) of the camera; stitching: calibration of an image stitched from two cameras; pose: rotation
    (3, 3) and translation (3,) m of the camera, needed for a dome, whose markers do not determine it. Raises BadArgument for an
    invalid stitching.
    """
    if stitching is not None:
        return partial(_known_view, stitched_view(stitching_from_dict(stitching, 'calibration: stitching')))
    if matrices is None:
        return None
    if sensor.is_sheet:
        return partial(_sheet_view, matrices, sensor)
    return partial(_known_view, CameraView(CameraModel(*matrices, *pose), sensor.plane_z))


def _known_view(view: MarkerView, _rest_uv: np.ndarray) -> MarkerView:
    return view


def _sheet_view(matrices: tuple[np.ndarray, np.ndarray], sensor: MarkerSensor, rest_uv: np.ndarray) -> MarkerView:
    return camera_view(*matrices, rest_uv, sensor)


def stitched_view(stitching: Stitching) -> StitchedView:
    """The view of an image with that stitching."""
    return StitchedView(1 / stitching.scale, np.asarray(stitching.origin, float), stitching.seam, stitching.eyes)

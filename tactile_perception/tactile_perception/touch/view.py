# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From the image to the viewing plane: the place where each marker appears to be, and the eye that sees it."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from tactile_driver.lens import undistorted

from ..camera import CameraModel
from ..dots.dots import DotTracks
from ..errors import BadArgument, BadFrame
from .field import MarkerField
from .sensor import MarkerSensor

FEWEST = 12  # markers that a pose is taken from
FARTHEST, FARTHEST_PX = 10.0, 1e5  # m, px: what appears farther out is no marker


class MarkerView(Protocol):
    """What turns image places into apparent places in the viewing plane."""

    metres_per_px: float

    def look(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Apparent places (N, 2), m, of image places uv (N, 2), px; the eyes (N, 3), m, that see them; the area (N,), m^2, that a pixel
        covers there. NaN where uv is."""


class CameraView:
    """One camera, its lens distortion taken off, that looks at the plane z = plane_z of the sensor frame."""

    def __init__(self, camera: CameraModel, plane_z: float = 0.0):
        self.camera, self.plane_z = camera, plane_z
        self._away = plane_z - camera.centre[2]
        self.metres_per_px = abs(self._away) / camera.matrix[0, 0]

    def look(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See MarkerView."""
        camera = self.camera
        flat = undistorted(uv, camera.matrix, camera.distortion)
        rays = flat @ camera.rotation[:2] + camera.rotation[2]
        xy = camera.centre[:2] + rays[:, :2] * (self._away / rays[:, 2:])
        xy[~(np.abs(xy) < FARTHEST).all(axis=1)] = np.nan
        # From the image to the plane without distortion, and from there to the viewing plane, which is a homography of this determinant.
        area = self._away**2 / np.abs(rays[:, 2])**3 / (camera.matrix[0, 0] * camera.matrix[1, 1] * _swelling(flat, camera.distortion))
        return xy, np.tile(camera.centre, (len(xy), 1)), area


def _swelling(flat: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """(N,) determinant of the slope of Brown's distortion (5,) at normalised places (N, 2): the growth of a small area."""
    k1, k2, p1, p2, k3 = distortion
    x, y = flat.T
    square = x * x + y * y
    swell = 1 + square * (k1 + square * (k2 + square * k3))
    slope = 2 * (k1 + square * (2 * k2 + square * 3 * k3))
    along = swell + x * x * slope + 2 * p1 * y + 6 * p2 * x
    down = swell + y * y * slope + 6 * p1 * y + 2 * p2 * x
    across = x * y * slope + 2 * p1 * x + 2 * p2 * y
    return np.abs(along * down - across * across)


@dataclass(frozen=True)
class StitchedView:
    """An image of the metric plane, stitched from two cameras along the column seam, px.

    metres_per_px: its scale; origin: (2,) px, where the sensor frame's origin appears; eyes: (2, 3) m, the left and the right camera.
    """

    metres_per_px: float
    origin: np.ndarray
    seam: float
    eyes: np.ndarray

    def look(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See MarkerView."""
        uv = np.asarray(uv, float).reshape(-1, 2)
        eye = np.asarray(self.eyes, float)[(uv[:, 0] > self.seam).astype(int)]
        return (uv - self.origin) * self.metres_per_px, eye, np.full(len(uv), self.metres_per_px**2)


def camera_view(matrix: np.ndarray, distortion: np.ndarray, rest_uv: np.ndarray, sensor: MarkerSensor) -> CameraView:
    """The view of one camera with K (3, 3) and distortion (5,) that sees the markers at rest_uv (K, 2), px (NaN: not seen).

    Its pose comes from the untouched markers and the nominal grid of a sheet (cv2.solvePnP). Raises BadArgument where the sensor has
    no flat grid or rest_uv is of another size, BadFrame where too few markers are seen.
    """
    grid, rest_uv = sensor.grid(), np.asarray(rest_uv, float)
    if not sensor.is_sheet or rest_uv.shape != grid.shape:
        raise BadArgument(f'the pose needs a flat grid of {len(grid)} markers, got {rest_uv.shape} of a {sensor.type}')
    seen = (np.abs(rest_uv) < FARTHEST_PX).all(1)
    if seen.sum() < FEWEST:
        raise BadFrame(f'{seen.sum()} untouched markers are too few for the pose of the camera; {FEWEST} are needed')
    flat = CameraModel(matrix, distortion)
    places = np.column_stack([grid[seen], np.zeros(seen.sum())])
    try:
        found, rotation, translation = cv2.solvePnP(places, rest_uv[seen], flat.matrix, flat.distortion)
    except cv2.error:  # markers at one place, or farther out than a number goes
        found = False
    if not found:
        raise BadFrame('no pose of the camera fits the untouched markers; check camera_info, rows, columns and pitch')
    return CameraView(CameraModel(matrix, distortion, cv2.Rodrigues(rotation)[0], translation.ravel()), sensor.plane_z)


def marker_field(tracks: DotTracks, rest_area: np.ndarray, view: MarkerView) -> MarkerField:
    """The field of one frame's tracks, whose numbers index rest_area (K,), px^2 (NaN: not known). Raises BadArgument for others."""
    rest_area = np.asarray(rest_area, float)
    if len(tracks) and not (0 <= tracks.id.min() and tracks.id.max() < len(rest_area)):
        raise BadArgument(f'marker numbers {tracks.id.min()} to {tracks.id.max()} do not fit a pattern of {len(rest_area)} markers')
    (now, rest), (eye, _), (pixel, rest_pixel) = (part.reshape(2, len(tracks), *part.shape[1:])
                                                  for part in view.look(np.concatenate([tracks.uv, tracks.rest_uv])))
    with np.errstate(divide='ignore', invalid='ignore'):
        growth = np.log(tracks.area / rest_area[tracks.id] * (pixel / rest_pixel))
    growth[~np.isfinite(growth)] = np.nan
    seen = dict(rest=rest, shift=now - rest, growth=growth, eye=eye, sigma=tracks.sigma * view.metres_per_px,
                uv=tracks.uv, duv=tracks.duv, area=tracks.area)
    return MarkerField(**{name: _spread(value, tracks.id, len(rest_area)) for name, value in seen.items()})


def _spread(value: np.ndarray, id: np.ndarray, count: int) -> np.ndarray:
    spread = np.full((count,) + value.shape[1:], np.nan)
    spread[id] = value
    return spread

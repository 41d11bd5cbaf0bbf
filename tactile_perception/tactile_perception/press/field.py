# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The marker field, the input of all methods, and the views of one camera and of two.

The field holds apparent marker positions in the viewing plane relative to the untouched markers.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from tactile_driver.stitching.calibration import Stitching, stitching_from_dict

from .. import _core
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.marker_sensor import MarkerSensor
from ..core.errors import BadArgument, BadFrame
from ..dots.reference import CalibratedRest
from .constants import PRESS


@dataclass(frozen=True)
class MarkerField:
    """The K markers of a pattern in one frame; NaN for markers that are not visible.

    Attributes
    ----------
    rest, shift : ndarray, shape (K, 2)
        Untouched position and displacement in m, both apparent: projected from the camera centre onto the viewing plane.
    growth : ndarray, shape (K,)
        Log of apparent area over untouched apparent area.
    camera_centre : ndarray, shape (K, 3)
        Centre, in m in the sensor frame, of the camera that observes the marker.
    uv, duv : ndarray, shape (K, 2)
        Position and displacement in the image in px.
    area : ndarray, shape (K,)
        Area in the image in px^2.
    """

    rest: np.ndarray
    shift: np.ndarray
    growth: np.ndarray
    camera_centre: np.ndarray
    uv: np.ndarray
    duv: np.ndarray
    area: np.ndarray

    def __len__(self) -> int:
        return len(self.rest)

    @cached_property
    def seen(self) -> np.ndarray:
        """Mask (K,) of the markers with a known displacement."""
        return np.isfinite(self.shift).all(1)


def marker_radii(field: MarkerField) -> np.ndarray:
    """Apparent radii (K,), m, of the untouched markers, by the image scale between neighbours; NaN if unknown."""
    apart, apart_px = (np.hypot(*np.diff(positions, axis=0).T) for positions in (field.rest, field.uv - field.duv))
    untouched = field.area * np.exp(-np.nan_to_num(field.growth))
    return np.sqrt(untouched / np.pi) * np.nanmedian(apart / apart_px)


class MarkerView:
    """A camera, with lens distortion, that views the plane z = plane_z, m, of the sensor frame.

    Parameters
    ----------
    camera : CameraModel
        The camera.
    plane_z : float
        Height of the plane in m.
    seam : float
        Column, in px, beyond which markers are seen from the second of camera_centres, in an image that is stitched from two cameras.
    camera_centres : ndarray, shape (2, 3), or None
        Centres of those cameras in m; None: that of camera.
    """

    def __init__(self, camera: CameraModel, plane_z: float = 0.0, seam: float = np.inf, camera_centres: np.ndarray | None = None):
        self.camera = camera
        centres = np.tile(camera.centre, (2, 1)) if camera_centres is None else np.asarray(camera_centres, float)
        self.kernel = _core.press.MarkerView(camera=camera.kernel, centre=camera.centre, plane_z=plane_z, seam=seam, camera_centres=centres)

    def back_project(self, uv: np.ndarray) -> np.ndarray:
        """Project uv (N, 2), px: apparent x and y, m, and the area of a pixel there, m^2, (N, 3); NaN where uv is NaN."""
        return self.kernel.back_project(np.asarray(uv, float))


def stitched_view(metres_per_px: float, origin: np.ndarray, seam: float, camera_centres: np.ndarray) -> MarkerView:
    """Make the view of an image of the viewing plane that is stitched from two cameras.

    origin: (2,) px, image of the origin of the sensor frame; seam: px, its column; camera_centres: (2, 3) m, of the left and the right
    camera.
    """
    matrix = np.array([[1 / metres_per_px, 0.0, origin[0]], [0.0, 1 / metres_per_px, origin[1]], [0.0, 0.0, 1.0]])
    return MarkerView(CameraModel(matrix, translation=np.array([0.0, 0.0, 1.0])), 0.0, seam, camera_centres)  # a pinhole a metre away


def camera_view(matrix: np.ndarray, distortion: np.ndarray, rest_uv: np.ndarray, sensor: MarkerSensor) -> MarkerView:
    """Make the view of one camera with K (3, 3) and distortion (5,) whose untouched markers are at rest_uv (K, 2), px; NaN: not visible.

    The pose follows from the untouched markers and the nominal grid of a sheet (cv2.solvePnP). Raises BadArgument if the sensor has no flat
    grid or rest_uv has another size, and BadFrame if too few markers are visible.
    """
    grid, rest_uv = sensor.grid(), np.asarray(rest_uv, float)
    if not sensor.is_sheet or rest_uv.shape != grid.shape:
        raise BadArgument(f'the pose needs a flat grid of {len(grid)} markers, got {rest_uv.shape} of a {sensor.type}')
    seen = (np.abs(rest_uv) < PRESS.max_coordinate_px).all(1)
    if seen.sum() < PRESS.min_markers:
        raise BadFrame(f'{seen.sum()} untouched markers are too few for the camera pose; {PRESS.min_markers} are needed')
    flat = CameraModel(matrix, distortion)
    positions = np.column_stack([grid[seen], np.zeros(seen.sum())])
    try:
        found, rotation, translation = cv2.solvePnP(positions, rest_uv[seen], flat.matrix, flat.distortion)
    except cv2.error:  # coincident markers, or overflow
        found = False
    if not found:
        raise BadFrame('no pose of the camera fits the untouched markers; check camera_info, rows, columns and pitch')
    return MarkerView(CameraModel(matrix, distortion, cv2.Rodrigues(rotation)[0], translation.ravel()), sensor.plane_z)


class RestMarkers:
    """Untouched positions and areas of the K markers of a pattern, updated with each frame.

    Parameters
    ----------
    count : int
        Number K of markers.
    make_view : callable
        Makes the view from untouched positions (K, 2), px, NaN if not visible; may raise BadFrame.
    """

    def __init__(self, count: int, make_view: Callable[[np.ndarray], MarkerView]):
        self._make_view, self._view = make_view, None
        rule = _core.press.RestRule(untouched_px=PRESS.untouched_px, area_time_s=PRESS.area_time_s)
        self._kernel = _core.press.RestMarkers(count, rule)

    @property
    def uv(self) -> np.ndarray:
        """(K, 2) untouched positions, px."""
        return self._kernel.uv

    @property
    def area(self) -> np.ndarray:
        """(K,) untouched areas, px^2."""
        return self._kernel.area

    def field(self, tracks: DotTracks, stamp_s: float) -> MarkerField:
        """Make the field of the frame at stamp_s, s. Raises BadFrame without a view, BadArgument for ids of another pattern."""
        kernel = copy(self._kernel)
        kernel.follow(tracks.id, tracks.uv, tracks.duv, tracks.area, stamp_s)
        view = self._make_view(kernel.uv) if kernel.is_view_outdated else self._view
        field = MarkerField(*kernel.field(view.kernel))
        self._kernel, self._view = kernel, view
        return field


def view_maker(sensor: MarkerSensor, matrices: tuple[np.ndarray, np.ndarray] | None, stitching: Mapping | None,
               pose: tuple[np.ndarray, np.ndarray] | None = None) -> Callable[[np.ndarray], MarkerView] | None:
    """Return a function that makes the view from untouched positions (K, 2), px; None if the camera is not calibrated.

    matrices: K (3, 3) and distortion (5,) of the camera; stitching: calibration of an image stitched from two cameras; pose: rotation (3,
    3) and translation (3,), m, of the camera, needed for a dome, whose markers do not determine it. Raises BadArgument for an invalid
    stitching.
    """
    if stitching is None and matrices is None:
        return None
    if stitching is None and sensor.is_sheet:
        return lambda rest_uv: camera_view(*matrices, rest_uv, sensor)
    view = (MarkerView(CameraModel(*matrices, *pose), sensor.plane_z) if stitching is None else
            _view_of(stitching_from_dict(stitching, 'calibration: stitching')))
    return lambda _rest_uv: view


def checked_view(make_view: Callable[[np.ndarray], MarkerView], rest: np.ndarray | None) -> Callable[[np.ndarray], MarkerView]:
    """Return a function that makes the view from untouched markers (K, 2), px, and raises BadFrame if these do not match rest.

    rest: (K, 2) px, the calibrated ones; None for no check.
    """
    if rest is None:
        return make_view
    known = CalibratedRest(rest)

    def checked(uv: np.ndarray) -> MarkerView:
        """Make the view for markers that match."""
        reason = known.judge(np.arange(len(uv)), uv).reason
        if reason:
            raise BadFrame(reason)
        return make_view(uv)
    return checked


def _view_of(stitching: Stitching) -> MarkerView:
    return stitched_view(1 / stitching.scale, stitching.origin, stitching.seam, stitching.camera_centres)


def common_rest(fields) -> tuple[np.ndarray, np.ndarray]:
    """Median untouched positions (K, 2), m, and camera centres (K, 3), m, of several fields (middle_of_seen)."""
    rest, camera_centre = np.stack([f.rest for f in fields]), np.stack([f.camera_centre for f in fields])
    return middle_of_seen(rest), middle_of_seen(camera_centre)


def middle_of_seen(values: np.ndarray) -> np.ndarray:
    """Median (K, 2 or 3) of positions (M, K, 2 or 3) over the frames in which a marker is visible; NaN if it never is."""
    seen = np.isfinite(values).all(-1).any(0)
    middle = np.full(values.shape[1:], np.nan)
    middle[seen] = np.nanmedian(values[:, seen], axis=0)
    return middle

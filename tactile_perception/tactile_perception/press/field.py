# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The marker field, the input of all methods, and the views of one camera and of two.

The field holds apparent marker positions in the viewing plane relative to the untouched markers.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from tactile_driver.stitching.calibration import Stitching, stitching_from_dict

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


class CameraView:
    """One camera, with lens distortion, that views the plane z = plane_z, m, of the sensor frame."""

    def __init__(self, camera: CameraModel, plane_z: float = 0.0):
        self.camera = camera
        self.metres_per_px = abs(plane_z - camera.centre[2]) / camera.matrix[0, 0]
        self._plane_z = plane_z

    def back_project(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project uv (N, 2), px, onto the viewing plane.

        Returns (N, 3), apparent x and y, m, and the area of a pixel there, m^2, NaN where uv is NaN; and the camera centres (N, 3), m, or
        the common one (1, 3).
        """
        centre = self.camera.centre
        return self.camera.kernel.back_project(np.asarray(uv, float), centre=centre, plane_z=self._plane_z), centre[None]


@dataclass(frozen=True)
class StitchedView:
    """An image of the viewing plane that is stitched from two cameras.

    Attributes
    ----------
    metres_per_px : float
        Scale of the image.
    origin : ndarray, shape (2,)
        Image of the origin of the sensor frame in px.
    seam : float
        Column of the seam in px.
    camera_centres : ndarray, shape (2, 3)
        Centres of the left and the right camera in m.
    """

    metres_per_px: float
    origin: np.ndarray
    seam: float
    camera_centres: np.ndarray

    def back_project(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project as CameraView does."""
        uv = np.asarray(uv, float).reshape(-1, 2)
        camera_centre = np.asarray(self.camera_centres, float)[(uv[:, 0] > self.seam).astype(int)]
        return np.column_stack([(uv - self.origin) * self.metres_per_px, np.full(len(uv), self.metres_per_px**2)]), camera_centre


MarkerView = CameraView | StitchedView


def camera_view(matrix: np.ndarray, distortion: np.ndarray, rest_uv: np.ndarray, sensor: MarkerSensor) -> CameraView:
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
    return CameraView(CameraModel(matrix, distortion, cv2.Rodrigues(rotation)[0], translation.ravel()), sensor.plane_z)


def marker_field(tracks: DotTracks, rest_area: np.ndarray, view: MarkerView) -> MarkerField:
    """Make the field of one frame's tracks, whose ids index rest_area (K,), px^2 (NaN: unknown). Raises BadArgument for other ids."""
    _check_ids(tracks, len(rest_area))

    def by_marker(values: np.ndarray) -> np.ndarray:
        """Arrange values (N, ...) of the tracks by marker (K, ...); NaN without a value."""
        out = np.full((len(rest_area), *values.shape[1:]), np.nan)
        out[tracks.id] = values
        return out

    positions, camera_centres = view.back_project(np.concatenate([tracks.uv, tracks.rest_uv]))
    now, rest = positions[:len(tracks)], positions[len(tracks):]
    with np.errstate(invalid='ignore', divide='ignore'):
        growth = np.log(tracks.area / rest_area[tracks.id] * (now[:, 2] / rest[:, 2]))
    growth[~np.isfinite(growth)] = np.nan
    return MarkerField(*map(by_marker, (rest[:, :2], now[:, :2] - rest[:, :2], growth, camera_centres[:len(tracks)],
                                        tracks.uv, tracks.duv, tracks.area)))


def _check_ids(tracks: DotTracks, count: int) -> None:
    if len(tracks) and not (0 <= tracks.id.min() and tracks.id.max() < count):
        raise BadArgument(f'marker ids {tracks.id.min()} to {tracks.id.max()} are not those of a pattern of {count} markers')


class RestMarkers:
    """Untouched positions and areas of the K markers of a pattern, updated with each frame.

    Parameters
    ----------
    count : int
        Number K of markers.
    make_view : callable
        Makes the view from untouched positions (K, 2), px, NaN if not visible; may raise BadFrame.

    Attributes
    ----------
    uv : ndarray, shape (K, 2)
        Untouched positions in px.
    area : ndarray, shape (K,)
        Untouched areas in px^2.
    """

    def __init__(self, count: int, make_view: Callable[[np.ndarray], MarkerView]):
        self._make_view = make_view
        self.uv, self.area = np.full((count, 2), np.nan), np.full(count, np.nan)
        self._counts, self._stamp_s = np.zeros(count), np.nan
        self._view_uv: np.ndarray | None = None
        self._view: MarkerView | None = None

    def field(self, tracks: DotTracks, stamp_s: float) -> MarkerField:
        """Make the field of the frame at stamp_s, s. Raises BadFrame without a view, BadArgument for ids of another pattern."""
        _check_ids(tracks, len(self.area))
        rest = tracks.rest_uv
        reported = np.isfinite(rest).all(1)
        id, now = tracks.id[reported], rest[reported]
        min_weight = max(stamp_s - self._stamp_s, 0.0) / PRESS.area_time_s if np.isfinite(self._stamp_s) else 0.0
        still = np.abs(tracks.duv[reported]).max(1, initial=0) <= PRESS.untouched_px
        uv, area, counts = self._followed(id, now, still, tracks.area[reported], min_weight)
        view, view_uv = self._view, self._view_uv
        if view is None or not (np.abs(now - view_uv[id]) <= PRESS.untouched_px).all():
            view, view_uv = self._make_view(uv), uv
        field = marker_field(tracks, area, view)
        self.uv, self.area, self._counts, self._view, self._view_uv, self._stamp_s = uv, area, counts, view, view_uv, stamp_s
        return field

    def _followed(self, id: np.ndarray, rest: np.ndarray, still: np.ndarray, area: np.ndarray,
                  min_weight: float) -> tuple[np.ndarray, ...]:
        """Update positions, mean areas and their numbers of samples with the untouched positions and areas of a frame.

        still: markers that hardly move, whose areas are averaged; min_weight: minimum weight of a new area.
        """
        uv, mean, counts = self.uv.copy(), self.area.copy(), self._counts.copy()
        counts[id[~(np.abs(rest - uv[id]) <= PRESS.untouched_px).all(1)]] = 0
        uv[id] = rest
        id, area = id[still], area[still]
        counts[id] += 1
        weight = np.maximum(1 / counts[id], min(min_weight, 1.0))  # at most 1: each has been counted
        mean[id] = np.where(counts[id] == 1, area, mean[id] + weight * (area - mean[id]))
        return uv, mean, counts


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
    view = (CameraView(CameraModel(*matrices, *pose), sensor.plane_z) if stitching is None else
            stitched_view(stitching_from_dict(stitching, 'calibration: stitching')))
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


def stitched_view(stitching: Stitching) -> StitchedView:
    """Make the view of an image with this stitching."""
    return StitchedView(1 / stitching.scale, np.asarray(stitching.origin, float), stitching.seam, stitching.camera_centres)


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

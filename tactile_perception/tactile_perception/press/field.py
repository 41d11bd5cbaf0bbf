# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The marker field, the input of all methods: apparent marker positions in the viewing plane relative to the untouched markers; and the
views of one camera and of two."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from tactile_driver.lens import farthest_square
from tactile_driver.stitching.calibration import Stitching, stitching_from_dict

from .. import _core
from ..common.camera import CameraModel
from ..common.dots import DotTracks
from ..common.marker_sensor import MarkerSensor
from ..dots.reference import CalibratedRest
from ..errors import BadArgument, BadFrame


@dataclass(frozen=True)
class MarkerField:
    """The markers of one frame; K markers in the pattern, entry k belongs to marker k, NaN where it is not seen.

    rest, shift: (K, 2) m, untouched position and displacement, both apparent: projected from the camera centre onto the viewing plane;
    growth: (K,) log of apparent area over untouched apparent area; camera_centre: (K, 3) m, sensor frame, centre of the camera that sees
    the marker; uv, duv: (K, 2) px, area: (K,) px^2: position, displacement and area in the image.
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
        """(K,) bool: markers with a known displacement."""
        return np.isfinite(self.shift).all(1)


def marker_radii(field: MarkerField) -> np.ndarray:
    """(K,) m, apparent radii of the untouched markers, by the scale of the image between neighbours; NaN unknown."""
    apart, apart_px = (np.hypot(*np.diff(places, axis=0).T) for places in (field.rest, field.uv - field.duv))
    untouched = field.area * np.exp(-np.nan_to_num(field.growth))
    return np.sqrt(untouched / np.pi) * np.nanmedian(apart / apart_px)


FEWEST = 12  # markers needed for a pose. Chosen
FARTHEST_PX = 1e5  # px: farther positions are invalid. Chosen: far outside any image


class CameraView:
    """One camera, with lens distortion, that views the plane z = plane_z, m, of the sensor frame."""

    def __init__(self, camera: CameraModel, plane_z: float = 0.0):
        self.camera = camera
        self.metres_per_px = abs(plane_z - camera.centre[2]) / camera.matrix[0, 0]
        self._numbers = dict(matrix=camera.matrix, distortion=camera.distortion, rotation=camera.rotation, centre=camera.centre,
                             farthest=farthest_square(camera.distortion), plane_z=plane_z)

    def back_project(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N, 3): apparent x and y, m, of uv (N, 2), px, and the area of a pixel there, m^2, NaN where uv is; the camera_centres (N, 3), m,
        that see them, or the one that sees all (1, 3)."""
        return _core.back_project(np.asarray(uv, float), **self._numbers), self.camera.centre[None]


@dataclass(frozen=True)
class StitchedView:
    """An image of the viewing plane, stitched from two cameras at column seam, px.

    metres_per_px: its scale; origin: (2,) px, image of the sensor frame's origin; camera_centres: (2, 3) m, centres of the left and right
    camera.
    """

    metres_per_px: float
    origin: np.ndarray
    seam: float
    camera_centres: np.ndarray

    def back_project(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As CameraView."""
        uv = np.asarray(uv, float).reshape(-1, 2)
        camera_centre = np.asarray(self.camera_centres, float)[(uv[:, 0] > self.seam).astype(int)]
        return np.column_stack([(uv - self.origin) * self.metres_per_px, np.full(len(uv), self.metres_per_px**2)]), camera_centre


MarkerView = CameraView | StitchedView


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
        raise BadFrame(f'{seen.sum()} untouched markers are too few for the camera pose; {FEWEST} are needed')
    flat = CameraModel(matrix, distortion)
    places = np.column_stack([grid[seen], np.zeros(seen.sum())])
    try:
        found, rotation, translation = cv2.solvePnP(places, rest_uv[seen], flat.matrix, flat.distortion)
    except cv2.error:  # coincident markers, or overflow
        found = False
    if not found:
        raise BadFrame('no pose of the camera fits the untouched markers; check camera_info, rows, columns and pitch')
    return CameraView(CameraModel(matrix, distortion, cv2.Rodrigues(rotation)[0], translation.ravel()), sensor.plane_z)


def marker_field(tracks: DotTracks, rest_area: np.ndarray, view: MarkerView) -> MarkerField:
    """The field of one frame's tracks, whose ids index rest_area (K,), px^2 (NaN: unknown). Raises BadArgument for other ids."""
    _check_ids(tracks, len(rest_area))

    def by_marker(values: np.ndarray) -> np.ndarray:
        """(K, ...) of values (N, ...) of the tracks; NaN where there is none."""
        out = np.full((len(rest_area), *values.shape[1:]), np.nan)
        out[tracks.id] = values
        return out

    places, camera_centres = view.back_project(np.concatenate([tracks.uv, tracks.rest_uv]))
    now, rest = places[:len(tracks)], places[len(tracks):]
    with np.errstate(invalid='ignore', divide='ignore'):
        growth = np.log(tracks.area / rest_area[tracks.id] * (now[:, 2] / rest[:, 2]))
    growth[~np.isfinite(growth)] = np.nan
    return MarkerField(*map(by_marker, (rest[:, :2], now[:, :2] - rest[:, :2], growth, camera_centres[:len(tracks)],
                                        tracks.uv, tracks.duv, tracks.area)))


def _check_ids(tracks: DotTracks, count: int) -> None:
    if len(tracks) and not (0 <= tracks.id.min() and tracks.id.max() < count):
        raise BadArgument(f'marker ids {tracks.id.min()} to {tracks.id.max()} are not those of a pattern of {count} markers')


_MOVED = 0.3  # px: a reference that changed by more is a new one. Chosen
_STILL = 0.3  # px: a marker displaced by less counts as untouched. Chosen likewise
_FOLLOWED_S = 2.0  # s, time constant of the average of the untouched area. Chosen


class RestMarkers:
    """Untouched positions and areas of the K markers of a pattern, updated with each frame.

    make_view: makes the view from untouched positions (K, 2) px, NaN where not seen; may raise BadFrame. uv: (K, 2) px; area: (K,) px^2.
    """

    def __init__(self, count: int, make_view: Callable[[np.ndarray], MarkerView]):
        self._make_view = make_view
        self.uv, self.area = np.full((count, 2), np.nan), np.full(count, np.nan)
        self._counts, self._stamp_s = np.zeros(count), np.nan
        self._view_uv: np.ndarray | None = None
        self._view: MarkerView | None = None

    def field(self, tracks: DotTracks, stamp_s: float) -> MarkerField:
        """The field of the frame at stamp_s, s, whose ids are below K. Raises BadFrame where there is no view, BadArgument for other
        ids."""
        _check_ids(tracks, len(self.area))
        rest = tracks.rest_uv
        reported = np.isfinite(rest).all(1)
        id, now = tracks.id[reported], rest[reported]
        slowest = max(stamp_s - self._stamp_s, 0.0) / _FOLLOWED_S if np.isfinite(self._stamp_s) else 0.0
        still = np.abs(tracks.duv[reported]).max(1, initial=0) <= _STILL
        uv, area, counts = self._followed(id, now, still, tracks.area[reported], slowest)
        view, view_uv = self._view, self._view_uv
        if view is None or not (np.abs(now - view_uv[id]) <= _MOVED).all():
            view, view_uv = self._make_view(uv), uv
        field = marker_field(tracks, area, view)
        self.uv, self.area, self._counts, self._view, self._view_uv, self._stamp_s = uv, area, counts, view, view_uv, stamp_s
        return field

    def _followed(self, id: np.ndarray, rest: np.ndarray, still: np.ndarray, area: np.ndarray,
                  slowest: float) -> tuple[np.ndarray, ...]:
        """Positions, mean areas and of how many, with a frame's untouched positions (N), and the areas of the markers that hardly move;
        slowest: least weight of these."""
        uv, mean, counts = self.uv.copy(), self.area.copy(), self._counts.copy()
        counts[id[~(np.abs(rest - uv[id]) <= _MOVED).all(1)]] = 0
        uv[id] = rest
        id, area = id[still], area[still]
        counts[id] += 1
        weight = np.clip(1 / counts[id], min(slowest, 1.0), 1.0)
        mean[id] = np.where(counts[id] == 1, area, mean[id] + weight * (area - mean[id]))
        return uv, mean, counts


def view_maker(sensor: MarkerSensor, matrices: tuple[np.ndarray, np.ndarray] | None, stitching: Mapping | None,
               pose: tuple[np.ndarray, np.ndarray] | None = None) -> Callable[[np.ndarray], MarkerView] | None:
    """A function that makes the view from untouched positions (K, 2) px; None where the camera is not calibrated.

    matrices: K (3, 3) and distortion (5,) of the camera; stitching: calibration of an image stitched from two cameras; pose: rotation
    (3, 3) and translation (3,) m of the camera, needed for a dome, whose markers do not determine it. Raises BadArgument for an
    invalid stitching.
    """
    if stitching is None and matrices is None:
        return None
    if stitching is None and sensor.is_sheet:
        return lambda rest_uv: camera_view(*matrices, rest_uv, sensor)
    view = (CameraView(CameraModel(*matrices, *pose), sensor.plane_z) if stitching is None else
            stitched_view(stitching_from_dict(stitching, 'calibration: stitching')))
    return lambda _rest_uv: view


def checked_view(make_view: Callable[[np.ndarray], MarkerView], rest: np.ndarray | None) -> Callable[[np.ndarray], MarkerView]:
    """A function that makes the view from untouched markers at (K, 2) px, and raises BadFrame where these do not match the calibrated
    ones, rest (K, 2) px; None for none."""
    if rest is None:
        return make_view
    known = CalibratedRest(rest)

    def checked(uv: np.ndarray) -> MarkerView:
        """The view for markers that match."""
        reason = known.judge(np.arange(len(uv)), uv).reason
        if reason:
            raise BadFrame(reason)
        return make_view(uv)
    return checked


def stitched_view(stitching: Stitching) -> StitchedView:
    """The view of an image with that stitching."""
    return StitchedView(1 / stitching.scale, np.asarray(stitching.origin, float), stitching.seam, stitching.camera_centres)


def common_rest(fields) -> tuple[np.ndarray, np.ndarray]:
    """Untouched positions (K, 2) m and camera_centres (K, 3) m, as of middle_of_seen."""
    rest, camera_centre = np.stack([f.rest for f in fields]), np.stack([f.camera_centre for f in fields])
    return middle_of_seen(rest), middle_of_seen(camera_centre)


def middle_of_seen(values: np.ndarray) -> np.ndarray:
    """Median (K, 2 or 3) of positions (M, K, 2 or 3) over the frames that see a marker; NaN where none does."""
    seen = np.isfinite(values).all(-1).any(0)
    middle = np.full(values.shape[1:], np.nan)
    middle[seen] = np.nanmedian(values[:, seen], axis=0)
    return middle

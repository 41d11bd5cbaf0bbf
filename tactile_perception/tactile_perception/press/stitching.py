# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Fits the stitching of two views of a marker sheet to one untouched pair: pose of each camera, seam, exposure."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import scipy

from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_driver.stitching.methods import make_stitcher

from ..common.dots import Dots
from ..common.marker_sensor import MarkerSensor
from ..common.statistics import robust_sigma
from ..core.errors import BadArgument, BadCalibration, BadFrame
from ..dots.detect import DotDetector
from ..dots.number import find_lattice, number_grid
from .constants import PRESS


@dataclass(frozen=True)
class SideMarkers:
    """Markers of an untouched view.

    Attributes
    ----------
    size : tuple of int
        Width and height in px.
    id : ndarray, shape (N,)
        Numbers on the whole grid.
    uv : ndarray, shape (N, 2)
        Positions in px.
    camera : tuple of ndarray
        K (3, 3) and distortion (5,).
    """

    size: tuple[int, int]
    id: np.ndarray
    uv: np.ndarray
    camera: tuple[np.ndarray, np.ndarray]


def fit_sides(found: list[SideMarkers], grid: np.ndarray) -> list[SideView]:
    """Fit both cameras jointly to the nominal marker positions grid (K, 2), m.

    Markers deviate from their nominal positions by the irregularity of the print, which is estimated. The two views of one marker differ by
    image noise only, which connects the cameras. Raises BadCalibration for a view with too few markers and for one that fits no camera.
    """
    poses, print_sigma = np.concatenate([_pose(markers, grid) for markers in found]), 1e-4

    def sides_at(poses: np.ndarray) -> list[SideView]:
        return [_side(markers, pose) for markers, pose in zip(found, poses.reshape(2, 6))]

    for _ in range(2):
        poses = scipy.optimize.least_squares(lambda poses, sigma=print_sigma: _misfit(sides_at(poses), found, grid, sigma), poses,
                                             x_scale='jac', loss='soft_l1').x
        sides = sides_at(poses)
        deviations = [side.place(m.uv) - grid[m.id] for side, m in zip(sides, found)]
        print_sigma = max(float(robust_sigma(np.concatenate(deviations))), PRESS.min_print_sigma)
    worst = max(float(np.sqrt((one**2).sum(1).mean())) for one in deviations)
    if not worst < PRESS.max_stitching_residual * np.linalg.norm(grid[1] - grid[0]):
        raise BadCalibration(f'the markers of a view deviate by {1e3 * worst:.2f} mm from the grid; check rows, columns, pitch and '
                             'camera_info')
    return sides


def _misfit(sides: list[SideView], found: list[SideMarkers], grid: np.ndarray, print_sigma: float) -> np.ndarray:
    """Normalised residuals: markers from the nominal grid, and the two views of each shared marker from each other."""
    positions, seen = np.zeros((2, len(grid), 2)), np.zeros((2, len(grid)), bool)
    for k, (side, markers) in enumerate(zip(sides, found)):
        positions[k, markers.id], seen[k, markers.id] = np.nan_to_num(side.place(markers.uv), nan=1.0), True  # far away
    both = seen.all(0)
    position = np.where(both[:, None], positions.sum(0) / 2, np.where(seen[0][:, None], positions[0], positions[1]))[seen.any(0)]
    apart = (positions[0] - positions[1])[both]
    noise = np.sqrt(2) * PRESS.marker_noise_px * _metres_per_px(sides[0])
    return np.concatenate([((position - grid[seen.any(0)]) / print_sigma).ravel(), (apart / noise).ravel()])


def _metres_per_px(side: SideView) -> float:
    centre = np.asarray(side.size) / 2
    return float(np.linalg.norm(np.diff(side.place(np.stack([centre, centre + [1, 0]])), axis=0)))


def _pose(markers: SideMarkers, grid: np.ndarray) -> np.ndarray:
    """Estimate the initial rotation vector and translation (6,), m, of one camera. Raises BadCalibration."""
    if len(markers.id) < PRESS.min_markers:
        raise BadCalibration(f'{len(markers.id)} markers in a view are too few for the camera pose; {PRESS.min_markers} are needed')
    if not (np.abs(markers.uv) < PRESS.max_coordinate_px).all():
        raise BadCalibration('the position of a marker in a view is not a number, or far outside the image')
    spread = np.linalg.svd(markers.uv - markers.uv.mean(axis=0), compute_uv=False)
    if not spread[1] > PRESS.min_aspect * spread[0]:
        raise BadCalibration('the matched markers are collinear; the camera pose cannot be determined; several rows must be visible')
    positions = np.column_stack([grid[markers.id], np.zeros(len(markers.id))])
    try:
        found, rotation, translation = cv2.solvePnP(positions, np.ascontiguousarray(markers.uv), *markers.camera)
    except cv2.error:  # for example for coincident markers or numeric overflow
        found = False
    if not found:
        raise BadCalibration('no pose of the camera fits the markers; check camera_info, rows, columns and pitch')
    return np.concatenate([rotation.ravel(), translation.ravel()])


def _side(markers: SideMarkers, pose: np.ndarray) -> SideView:
    turn, shift = cv2.Rodrigues(pose[:3])[0], pose[3:]
    return SideView(markers.size, *markers.camera, np.column_stack([turn[:, :2], shift]), -turn.T @ shift)


SIDES = ('left', 'right')
Intrinsics = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class StitchingFit:
    """Result of a fit.

    Attributes
    ----------
    stitching : Stitching
        The stitching.
    residual : float
        RMS distance in m of the markers in the stitched image from the nominal grid, including the print's irregularity.
    overlap : float
        RMS distance in m between the two views of a marker; NaN without a shared marker.
    shared : list of int
        Columns visible to both cameras.
    markers : int
        Number of markers in the stitched image.
    """

    stitching: Stitching
    residual: float
    overlap: float
    shared: list[int]
    markers: int

    def lines(self) -> list[str]:
        """Describe the fit, with residuals in px and mm."""
        found, scale = self.stitching, self.stitching.scale
        shared = f'{self.shared[0]} to {self.shared[-1]}' if self.shared else 'none'
        cameras = [f'{name} ({", ".join(f"{1e3 * x:.2f}" for x in centre)}) mm' for name, centre in zip(SIDES, found.camera_centres)]
        both = f'; the two views of one differ by {self.overlap * scale:.3f} px, {self.overlap * 1e3:.4f} mm RMS' if self.shared else ''
        return [f'stitched picture {found.size[0]} x {found.size[1]} px at {scale / 1e3:.3f} px/mm, {self.markers} markers; columns '
                f'visible to both cameras: {shared}',
                f'deviation of the markers from the nominal grid: {self.residual * scale:.3f} px, {self.residual * 1e3:.4f} mm RMS{both}',
                f'cameras at {", ".join(cameras)}; grey levels times {found.left.gain:.3f} left, {found.right.gain:.3f} right']


def fit_stitching(images: tuple[np.ndarray, np.ndarray], cameras: tuple[Intrinsics, Intrinsics], sensor: MarkerSensor,
                  polarity: str = 'bright', detection: str = 'blobs', method: str = 'plane') -> StitchingFit:
    """Fit the stitching to one untouched pair.

    images: left and right, uint8 (H, W, 3) BGR or (H, W); cameras: K (3, 3) and distortion (5,) of each; sensor: a sheet with a grid;
    polarity, detection: of the marker detector; method: of tactile_driver's stitching that makes the picture: scale and origin of the cut
    views of 'middle', which is not metric, are those that fit the untouched grid best. The left camera has to see column 0, the right one
    the last column. Raises BadCalibration for a pair that does not determine the stitching, BadFrame for an image without markers,
    BadArgument for a sensor that is not a sheet with a grid.
    """
    if not sensor.is_sheet or min(sensor.rows, sensor.columns) < 2:
        raise BadArgument(f'stitching needs a sheet with a printed grid, not {sensor}')
    found = [_numbered(image, camera, sensor, side, DotDetector(polarity, detection))
             for image, camera, side in zip(images, cameras, (0, 1))]
    whole = [_whole_columns(markers, sensor) for markers in found]
    seam = _seam(whole, sensor)
    sides = fit_sides(found, sensor.grid())
    overlap = _overlap(found, sides)
    laid_out = _joined(found, sides, sensor.grid()) if method == 'middle' else _laid_out(sides, seam, sensor)
    stitching = _matched(images, laid_out)
    residual, markers = _residual(images, stitching, sensor, DotDetector(polarity, detection), method)
    return StitchingFit(stitching, residual, overlap, sorted(whole[0] & whole[1]), markers)


def _numbered(image: np.ndarray, camera: Intrinsics, sensor: MarkerSensor, side: int, detector: DotDetector) -> SideMarkers:
    """Markers of one view with their ids on the whole sheet. Raises BadFrame, BadCalibration."""
    try:
        dots: Dots = detector.detect(image)
    except BadFrame as error:
        raise BadFrame(f'{SIDES[side]} image: {error}') from error
    lattice = find_lattice(dots.uv)
    rc = lattice.rc[lattice.member] if lattice is not None else np.zeros((0, 2), int)
    seen = np.ptp(rc, axis=0) + 1 if len(rc) else (0, 0)
    if seen[0] != sensor.rows or seen[1] > sensor.columns:
        raise BadCalibration(f'{SIDES[side]} image: {seen[0]} rows and {seen[1]} columns of markers found, the sheet has {sensor.rows} and '
                             f'{sensor.columns}: all rows must be seen; check the view, the light and the parameters rows and columns')
    row = rc[:, 0] - rc[:, 0].min()
    column = rc[:, 1] - rc[:, 1].min() if side == 0 else rc[:, 1] - rc[:, 1].max() + sensor.columns - 1
    return SideMarkers((image.shape[1], image.shape[0]), row * sensor.columns + column, dots.uv[lattice.member], camera)


def _whole_columns(markers: SideMarkers, sensor: MarkerSensor) -> set[int]:
    column, count = np.unique(markers.id % sensor.columns, return_counts=True)
    return set(column[count >= PRESS.min_column_share * sensor.rows].tolist())


def _seam(whole: list[set[int]], sensor: MarkerSensor) -> float:
    """Seam, x in m: midway between two columns near the centre of the overlap; each camera sees one side in full.

    Raises BadCalibration for a gap between the views.
    """
    last, first = max(whole[0], default=-1), min(whole[1], default=sensor.columns)
    if first > last + 1:
        raise BadCalibration(f'the left camera sees the columns up to {last}, the right one those from {first}: there is a gap between '
                             'them; turn or move the cameras')
    return ((first - 1 + last) // 2 + 0.5 - (sensor.columns - 1) / 2) * sensor.pitch[0]


def _overlap(found: list[SideMarkers], sides: list[SideView]) -> float:
    """RMS distance, m, between the two views of a marker; NaN without a shared marker."""
    _, left, right = np.intersect1d(found[0].id, found[1].id, return_indices=True)
    apart = sides[0].place(found[0].uv[left]) - sides[1].place(found[1].uv[right])
    return float(np.sqrt((apart**2).sum(1).mean())) if len(apart) else np.nan


def _laid_out(sides: list[SideView], seam: float, sensor: MarkerSensor) -> Stitching:
    """Stitching that shows the whole sheet at PRESS.stitched_resolution times the resolution of the views at their centres."""
    middle = [np.array([(side.size[0] - 1) / 2, (side.size[1] - 1) / 2]) for side in sides]
    steps = [np.diff(side.place(m + [[0, 0], [1, 0], [0, 1]]), axis=0) for side, m in zip(sides, middle)]
    scale = float(np.round(PRESS.stitched_resolution * np.mean([1 / np.linalg.norm(step[0]) for step in steps]), -1))
    size = tuple(int(n) for n in np.ceil(np.asarray(sensor.size) * scale))
    origin = (np.asarray(size) - 1) / 2
    return Stitching(*sides, size, scale, origin, float(np.floor(origin[0] + seam * scale) + 0.5), _cut(sides))


def _joined(found: list[SideMarkers], sides: list[SideView], grid: np.ndarray) -> Stitching:
    """Stitching of two views that are cut at the middle of their overlap and put side by side.

    One scale and one origin are fitted by least squares over the markers of each half.
    """
    cut = _cut(sides)
    left, right = round(cut[0]), round(cut[1])
    shown = found[0].uv[:, 0] < left, found[1].uv[:, 0] >= right
    uv = np.concatenate([found[0].uv[shown[0]], found[1].uv[shown[1]] + [left - right, 0]])
    id = np.concatenate([markers.id[some] for markers, some in zip(found, shown)])
    position, middle = grid[id] - grid[id].mean(axis=0), uv.mean(axis=0)
    scale = float((position * (uv - middle)).sum() / (position**2).sum())
    size = left + sides[1].size[0] - right, sides[0].size[1]
    return Stitching(*sides, size, scale, middle - scale * grid[id].mean(axis=0), left - 0.5, cut)


def _cut(sides: list[SideView]) -> tuple[float, float]:
    """Columns, px, of the left and the right image that show the centre of the overlap."""
    (left_width, height), _ = (side.size for side in sides)
    ends = sides[0].place([[left_width - 1, height / 2]])[0], sides[1].place([[0, height / 2]])[0]
    middle = np.mean(ends, axis=0)
    return tuple(float(np.clip(side.project(middle)[0, 0], 1, side.size[0] - 1)) for side in sides)


def _matched(images: tuple, stitching: Stitching) -> Stitching:
    """Add gains that match the exposures in the overlap: the brighter view is darkened, so that nothing saturates."""
    ratio = _brightness_ratio(images, stitching)
    gains = (1.0, ratio) if ratio < 1 else (1 / ratio, 1.0)
    sides = [SideView(s.size, s.matrix, s.distortion, s.homography, s.camera_centre, float(gain))
             for s, gain in zip((stitching.left, stitching.right), gains)]
    return Stitching(*sides, stitching.size, stitching.scale, stitching.origin, stitching.seam, stitching.cut)


def _brightness_ratio(images: tuple, stitching: Stitching) -> float:
    """Brightness of the left view over that of the right one, over pixels bright in both; 1 without such pixels."""
    u, v = np.meshgrid(np.arange(0, stitching.size[0], 2), np.arange(0, stitching.size[1], 2))
    positions = stitching.place(np.stack([u, v], axis=-1))
    levels = []
    for image, side in zip(images, (stitching.left, stitching.right)):
        uv = side.project(positions).astype(np.float32).reshape(*u.shape, 2)
        levels.append(cv2.remap(image if image.ndim == 2 else image.max(axis=2), uv, None, cv2.INTER_LINEAR).astype(float))
    usable = (np.minimum(*levels) >= PRESS.exposures[0]) & (np.maximum(*levels) <= PRESS.exposures[1])
    if not usable.any():
        return 1.0
    total = np.add(*levels)
    bright = usable & (total >= total[usable].mean())
    return float(levels[0][bright].sum() / levels[1][bright].sum())


def _residual(images: tuple, stitching: Stitching, sensor: MarkerSensor, detector: DotDetector, method: str) -> tuple[float, int]:
    """RMS distance, m, of the markers in the stitched picture from the grid, and their number. Raises BadCalibration without a grid."""
    dots = detector.detect(make_stitcher(method, stitching).stitch(*images))
    numbers = number_grid(dots.uv, sensor.rows, sensor.columns)
    if not numbers.certain:
        raise BadCalibration(f'the stitched picture shows no grid of {sensor.rows} x {sensor.columns} markers: {numbers.reason}')
    seen = numbers.id >= 0
    off = stitching.place(dots.uv[seen]) - sensor.grid()[numbers.id[seen]]
    return float(np.sqrt((off**2).sum(1).mean())), int(seen.sum())

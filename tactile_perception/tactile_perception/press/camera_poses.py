# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Estimates the poses of two cameras over one printed grid; a marker that both cameras see has one position."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import scipy
from tactile_driver.stitching.calibration import SideView

from ..common.statistics import robust_sigma
from ..errors import BadCalibration

FEWEST = 12  # markers of one view, chosen
MARKER_NOISE = 0.04  # px per axis, chosen: standard deviation of a detected marker's position
FINEST_PRINT = 2e-6  # m, chosen: lower bound of the print's irregularity
LARGEST_RESIDUAL = 0.1  # RMS over the pitch, chosen: a larger one means mismatched markers or a wrong pitch
SLENDER = 0.02  # chosen: smallest ratio of width to length of the markers in a view
FARTHEST = 1e5  # px, chosen: larger than any image
HIDDEN = 1.0  # m, chosen: position for markers that the distortion model cannot invert
ROUNDS = 2  # chosen: alternations between fitting and estimating the irregularity of the print

Parameters = np.ndarray


@dataclass(frozen=True)
class SideMarkers:
    """Markers of an untouched view.

    size: (width, height) px; id: (N,) ids on the whole grid; uv: (N, 2) px; camera: K (3, 3) and distortion (5,), None when unknown.
    """

    size: tuple[int, int]
    id: np.ndarray
    uv: np.ndarray
    camera: tuple[np.ndarray, np.ndarray] | None


def fit_sides(found: list[SideMarkers], grid: np.ndarray) -> list[SideView]:
    """Fit both cameras jointly to the nominal marker positions grid (K, 2), m.

    Markers deviate from their nominal positions by the irregularity of the print, which is estimated. The two views of one marker differ by
    image noise only and so tie the cameras together. Raises BadCalibration for a view with too few markers and for one that fits no camera.
    """
    models = [_model(markers, grid) for markers in found]
    split = len(models[0][0])
    start, makes = np.concatenate([first for first, _ in models]), [make for _, make in models]
    print_sigma = 1e-4
    for _ in range(ROUNDS):
        fitted = scipy.optimize.least_squares(lambda q: _misfit(_sides(q, split, makes), found, grid, print_sigma), start, x_scale='jac',
                                              loss='soft_l1')
        start, sides = fitted.x, _sides(fitted.x, split, makes)
        off = [side.place(m.uv) - grid[m.id] for side, m in zip(sides, found)]
        print_sigma = max(float(robust_sigma(np.concatenate(off))), FINEST_PRINT)
    worst = max(float(np.sqrt((o**2).sum(1).mean())) for o in off)
    if not worst < LARGEST_RESIDUAL * np.linalg.norm(grid[1] - grid[0]):
        raise BadCalibration(f'the markers of a view lie {1e3 * worst:.2f} mm off the grid: check rows, columns and pitch, and camera_info')
    return sides


def _sides(parameters: Parameters, split: int, makes: list) -> list[SideView]:
    return [makes[0](parameters[:split]), makes[1](parameters[split:])]


def _misfit(sides: list[SideView], found: list[SideMarkers], grid: np.ndarray, print_sigma: float) -> np.ndarray:
    """Normalised residuals: markers from the nominal grid, and the two views of each shared marker from each other."""
    places, seen = np.zeros((2, len(grid), 2)), np.zeros((2, len(grid)), bool)
    for k, (side, markers) in enumerate(zip(sides, found)):
        places[k, markers.id], seen[k, markers.id] = np.nan_to_num(side.place(markers.uv), nan=HIDDEN), True
    both = seen.all(0)
    place = np.where(both[:, None], places.sum(0) / 2, np.where(seen[0][:, None], places[0], places[1]))[seen.any(0)]
    apart = (places[0] - places[1])[both]
    noise = np.sqrt(2) * MARKER_NOISE * _metres_per_px(sides[0])
    return np.concatenate([((place - grid[seen.any(0)]) / print_sigma).ravel(), (apart / noise).ravel()])


def _metres_per_px(side: SideView) -> float:
    centre = np.asarray(side.size) / 2
    return float(np.linalg.norm(np.diff(side.place(np.stack([centre, centre + [1, 0]])), axis=0)))


def _model(markers: SideMarkers, grid: np.ndarray) -> tuple[Parameters, Callable[[Parameters], SideView]]:
    """Initial parameters of one camera, and the function from parameters to camera. Raises BadCalibration."""
    if len(markers.id) < FEWEST:
        raise BadCalibration(f'{len(markers.id)} markers in a view are too few to tell where the camera stands; {FEWEST} are needed')
    if not (np.abs(markers.uv) < FARTHEST).all():
        raise BadCalibration('the place of a marker in a view is no number, or far out of the image')
    spread = np.linalg.svd(markers.uv - markers.uv.mean(axis=0), compute_uv=False)
    if not spread[1] > SLENDER * spread[0]:
        raise BadCalibration('the markers of a view lie on a line, which tells of no camera; several rows must be seen')
    return _free_model(markers, grid) if markers.camera is None else _posed_model(markers, grid)


def _posed_model(markers: SideMarkers, grid: np.ndarray):
    """Camera with known intrinsics; parameters: rotation vector, translation (m)."""
    matrix, distortion = markers.camera
    places = np.column_stack([grid[markers.id], np.zeros(len(markers.id))])
    try:
        found, rotation, translation = cv2.solvePnP(places, np.ascontiguousarray(markers.uv), matrix, distortion)
    except cv2.error:  # for example for coincident markers or numeric overflow
        found = False
    if not found:
        raise BadCalibration('no pose of the camera fits the markers; check camera_info, rows, columns and pitch')

    def make(parameters: Parameters) -> SideView:
        turn, shift = cv2.Rodrigues(parameters[:3])[0], parameters[3:]
        return SideView(markers.size, matrix, distortion, np.column_stack([turn[:, :2], shift]), -turn.T @ shift)
    return np.concatenate([rotation.ravel(), translation.ravel()]), make


def _free_model(markers: SideMarkers, grid: np.ndarray):
    """Camera with unknown intrinsics, at an unknown position; parameters: homography (last element 1), k1 about the image centre."""
    width, height = markers.size
    matrix = np.array([[width, 0, (width - 1) / 2], [0, width, (height - 1) / 2], [0, 0, 1]], float)
    extent = np.diag([1 / np.ptp(grid), 1 / np.ptp(grid), 1.0])
    first = cv2.findHomography(grid[markers.id] @ extent[:2, :2], (markers.uv - matrix[:2, 2]) / width)[0]
    if first is None:
        raise BadCalibration('no camera fits the markers; check rows and columns')

    def make(parameters: Parameters) -> SideView:
        homography = np.append(parameters[:8], 1.0).reshape(3, 3) @ extent
        return SideView(markers.size, matrix, np.array([parameters[8], 0, 0, 0, 0]), homography, np.full(3, np.nan))
    return np.append((first / first[2, 2]).ravel()[:8], 0.0), make

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stitching calibration: the geometry that maps two camera views of a flat sheet to one image, and its file format."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import yaml

from ..errors import BadArgument
from ..lens import undistorted

LARGEST_SIDE = 8192  # px, largest width and height of an image


@dataclass(frozen=True)
class SideView:
    """One camera and its view of the plane z = 0 of the sensor frame.

    size: (width, height) px of its images; matrix: (3, 3) K, px; distortion: (5,) k1 k2 p1 p2 k3; homography: (3, 3) from the plane, m,
    to the undistorted normalised image; camera_centre: (3,) m, centre of projection in the sensor frame, NaN if only the homography is
    known; gain: factor that matches its grey levels to those of the other camera.
    """

    size: tuple[int, int]
    matrix: np.ndarray
    distortion: np.ndarray
    homography: np.ndarray
    camera_centre: np.ndarray
    gain: float = 1.0

    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """Rotation vector (3,) and translation (3,), m, from the sensor frame to the camera's. The camera centre must be known."""
        x, y = self.homography[:, 0], self.homography[:, 1]
        u, _, v = np.linalg.svd(np.column_stack([x, y, np.cross(x, y) / np.sqrt(np.linalg.norm(x) * np.linalg.norm(y))]))
        rotation = u @ v
        return cv2.Rodrigues(rotation)[0].ravel(), -rotation @ self.camera_centre

    def project(self, xy: np.ndarray) -> np.ndarray:
        """Pixels (N, 2) of points xy (N, 2), m, in the plane."""
        seen = np.column_stack([np.asarray(xy, float).reshape(-1, 2), np.ones(np.size(xy) // 2)]) @ self.homography.T
        still = np.zeros(3)
        if not len(seen):
            return np.zeros((0, 2))
        return cv2.projectPoints(seen.reshape(-1, 1, 3), still, still, self.matrix, self.distortion)[0].reshape(-1, 2)

    def place(self, uv: np.ndarray) -> np.ndarray:
        """Points (N, 2), m, in the plane of pixels uv (N, 2); NaN where undistorted gives NaN."""
        flat = undistorted(uv, self.matrix, self.distortion)
        seen = np.column_stack([flat, np.ones(len(flat))]) @ np.linalg.inv(self.homography).T
        return seen[:, :2] / seen[:, 2:]


@dataclass(frozen=True)
class Stitching:
    """How two views are stitched to one image of the plane z = 0 of the sensor frame.

    left, right: the cameras; size: (width, height) px of the stitched image; scale: px/m; origin: (2,) px, image of the sensor frame's
    origin; seam: px, columns up to it come from the left camera, those beyond it from the right one; cut: (2,) px, columns of the left and
    the right image that show the middle of the overlap.
    """

    left: SideView
    right: SideView
    size: tuple[int, int]
    scale: float
    origin: np.ndarray
    seam: float
    cut: tuple[float, float]

    @property
    def camera_centres(self) -> np.ndarray:
        """(2, 3) m: centres of projection of the left and the right camera in the sensor frame."""
        return np.stack([self.left.camera_centre, self.right.camera_centre])

    def poses(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Rotation vector (3,) and translation (3,), m, from the sensor frame to the frames of the left and the right camera, and, as '',
        of the stitched image: between both, upright; empty where the positions of the cameras are not known."""
        if not np.isfinite(self.camera_centres).all():
            return {}
        return {'left': self.left.pose(), 'right': self.right.pose(), '': (np.zeros(3), -self.camera_centres.mean(axis=0))}

    def side_of(self, uv: np.ndarray) -> np.ndarray:
        """(N,) 0 or 1: whether pixels uv (N, 2) of the stitched image come from the left or the right camera."""
        return (np.asarray(uv, float).reshape(-1, 2)[:, 0] > self.seam).astype(int)

    def place(self, uv: np.ndarray) -> np.ndarray:
        """Points (N, 2), m, in the plane of pixels uv (N, 2) of the stitched image."""
        return (np.asarray(uv, float).reshape(-1, 2) - self.origin) / self.scale

    def to_dict(self) -> dict:
        """The stitching as plain numbers and lists, for a file; an unknown camera centre is omitted."""
        return {'size': list(self.size), 'scale': float(self.scale), 'origin': np.asarray(self.origin, float).tolist(),
                'seam': float(self.seam), 'cut': [float(c) for c in self.cut],
                'left': _side_to_dict(self.left), 'right': _side_to_dict(self.right)}


def _side_to_dict(side: SideView) -> dict:
    numbers = {name: np.asarray(getattr(side, name), float).tolist() for name in ('matrix', 'distortion', 'homography')}
    camera_centre = {'camera_centre': np.asarray(side.camera_centre, float).tolist()} if np.isfinite(side.camera_centre).all() else {}
    return {'size': [int(n) for n in side.size], **numbers, **camera_centre, 'gain': float(side.gain)}


def stitching_from_dict(numbers: Mapping, label: str) -> Stitching:
    """Inverse of to_dict; label: name of the source in error messages. Raises BadArgument for missing, non-finite or invalid values."""
    sides = [_side_from_dict(_part(numbers, name, label), f'{label}.{name}') for name in ('left', 'right')]
    scale, seam = float(_array(numbers, 'scale', (), label)), float(_array(numbers, 'seam', (), label))
    size, cut = _size(numbers, label), tuple(_array(numbers, 'cut', (2,), label).tolist())
    if scale <= 0 or not 0 <= seam < size[0] - 1 or not all(0 < c < side.size[0] for c, side in zip(cut, sides)):
        raise BadArgument(f'{label}: scale {scale} px/m, seam {seam} px and cut {cut} px do not fit the sizes; run calibrate again')
    return Stitching(*sides, size, scale, _array(numbers, 'origin', (2,), label), seam, cut)


def _side_from_dict(numbers: Mapping, label: str) -> SideView:
    matrix, distortion = _array(numbers, 'matrix', (3, 3), label), _array(numbers, 'distortion', (5,), label)
    homography, gain = _array(numbers, 'homography', (3, 3), label), float(_array(numbers, 'gain', (), label))
    camera_centre = _array(numbers, 'camera_centre', (3,), label) if 'camera_centre' in numbers else np.full(3, np.nan)
    if min(matrix[0, 0], matrix[1, 1], gain) <= 0 or abs(np.linalg.det(homography)) < 1e-12:
        raise BadArgument(f'{label}: focal lengths and gain must be above 0 and the homography regular; run calibrate again')
    return SideView(_size(numbers, label), matrix, distortion, homography, camera_centre, gain)


def _part(numbers: Mapping, name: str, label: str):
    if not isinstance(numbers, Mapping) or name not in numbers:
        raise BadArgument(f'{label}: no {name}; run calibrate again on an untouched pair')
    return numbers[name]


def _array(numbers: Mapping, name: str, shape: tuple, label: str) -> np.ndarray:
    try:
        values = np.asarray(_part(numbers, name, label), float)
    except (TypeError, ValueError):
        values = np.full(1, np.nan)
    if values.shape != shape or not np.isfinite(values).all():
        raise BadArgument(f'{label}.{name} must be {shape or "one"} finite numbers, got {numbers[name]!r}; run calibrate again')
    return values


def _size(numbers: Mapping, label: str) -> tuple[int, int]:
    width, height = _array(numbers, 'size', (2,), label).tolist()
    if not (2 <= width <= LARGEST_SIDE and 2 <= height <= LARGEST_SIDE):
        raise BadArgument(f'{label}.size is {width} x {height} px, must be 2 to {LARGEST_SIDE}; run calibrate again')
    return int(width), int(height)


def load_stitching(path: str) -> Stitching:
    """The stitching in a calibration file written by `calibrate`. Raises BadArgument if the file holds none."""
    try:
        # The file holds much more than the stitching: the C loader reads it in a tenth of the time.
        loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
        page = yaml.load(Path(path).expanduser().read_text(encoding='utf-8'), loader)
        found = page['fitted']['stitching']
    except (OSError, UnicodeDecodeError, yaml.YAMLError, TypeError, KeyError) as error:
        raise BadArgument(f'stitching_path: {path} holds no stitching ({error!r}); calibrate finds it from an untouched pair') from error
    return stitching_from_dict(found, f'{path}: stitching')

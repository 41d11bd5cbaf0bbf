# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stitching methods, by name.

A stitcher's size is (width, height) px of its result. Its stitch makes the image, uint8 (H, W, 3) or (H, W), of two uint8 images, both
colour or both grey; the part of a missing one (None) is black. It raises BadFrame for another size than that of the calibration, for two
kinds, and if both are missing.
"""
from __future__ import annotations

import cv2
import numpy as np

from ..errors import BadArgument, BadFrame, by_name
from .calibration import SideView, Stitching

_BAND = 64  # rows remapped at once, so that they stay in the processor's cache


class MiddleStitcher:
    """Cuts both images at the middle of their overlap and joins them (paper areal_sensor_contact_position, section 2.2).

    sizes: (width, height) px of the left and the right images; cut: px, columns at which they are cut. Raises BadArgument for two heights.
    """

    def __init__(self, sizes: tuple[tuple[int, int], tuple[int, int]], cut: tuple[float, float]):
        (left, height), (right, other) = sizes
        if height != other:
            raise BadArgument(f'stitching: method middle needs two views of one height, got {height} and {other} px')
        self._sizes, self._cut = sizes, (min(max(round(cut[0]), 1), left), min(max(round(cut[1]), 0), right - 1))
        self.size = self._cut[0] + right - self._cut[1], height

    def stitch(self, left: np.ndarray | None, right: np.ndarray | None) -> np.ndarray:
        """The stitched image of two, either of which may be None."""
        picture = _empty_picture((left, right), self._sizes, self.size)
        if left is not None:
            picture[:, :self._cut[0]] = left[:, :self._cut[0]]
        if right is not None:
            picture[:, self._cut[0]:] = right[:, self._cut[1]:]
        return picture


class PlaneStitcher:
    """Warps each view to the metric plane of the sheet, with undistortion and exposure matching, along precomputed maps."""

    def __init__(self, stitching: Stitching):
        self.size, self._sides = stitching.size, (stitching.left, stitching.right)
        first = int(np.floor(stitching.seam)) + 1
        self._bands = [_bands(stitching, side, columns)
                       for side, columns in zip(self._sides, (slice(0, first), slice(first, stitching.size[0])))]

    def stitch(self, left: np.ndarray | None, right: np.ndarray | None) -> np.ndarray:
        """The stitched image of two, either of which may be None."""
        picture = _empty_picture((left, right), [side.size for side in self._sides], self.size)
        for image, side, bands in zip((left, right), self._sides, self._bands):
            for band, maps in bands if image is not None else ():
                part = picture[band]
                cv2.remap(image, *maps, cv2.INTER_LINEAR, part, cv2.BORDER_CONSTANT)
                if side.gain != 1.0:
                    cv2.convertScaleAbs(part, part, side.gain)
        return picture


def _bands(stitching: Stitching, side: SideView, columns: slice) -> list[tuple[tuple[slice, slice], tuple[np.ndarray, np.ndarray]]]:
    """((rows, columns) of the stitched image, remap maps) of each band of _BAND rows."""
    maps = _maps(stitching, side, columns)
    rows = [slice(first, first + _BAND) for first in range(0, stitching.size[1], _BAND)]
    return [((band, columns), tuple(np.ascontiguousarray(part[band]) for part in maps)) for band in rows]


def _maps(stitching: Stitching, side: SideView, columns: slice) -> tuple[np.ndarray, np.ndarray]:
    """Remap maps, in OpenCV's fixed-point form, from the columns of the stitched image to the image of this camera."""
    height = stitching.size[1]
    u, v = np.meshgrid(np.arange(columns.start, columns.stop), np.arange(height))
    found = side.project(stitching.place(np.stack([u, v], axis=-1)))
    x, y = (found[:, k].reshape(height, -1).astype(np.float32) for k in (0, 1))
    return cv2.convertMaps(x, y, cv2.CV_16SC2)


def _empty_picture(images: tuple, sizes, size: tuple[int, int]) -> np.ndarray:
    """Check the images and allocate the stitched image, black if one is missing. Raises BadFrame."""
    present = [(image, wanted, name) for image, wanted, name in zip(images, sizes, ('left', 'right')) if image is not None]
    for image, wanted, name in present:
        if image.shape[1::-1] != tuple(wanted):
            raise BadFrame(f'the {name} image is {image.shape[1]} x {image.shape[0]} px, the stitching is for {wanted[0]} x {wanted[1]} '
                           'px; calibrate at this size')
    if not present or len({image.shape[2:] for image, _, _ in present}) > 1:
        raise BadFrame('nothing to stitch: no image, or a grey one beside a coloured one')
    make = np.empty if len(present) == 2 else np.zeros
    return make((size[1], size[0]) + present[0][0].shape[2:], np.uint8)


STITCHERS = {'plane': PlaneStitcher,
             'middle': lambda stitching: MiddleStitcher((stitching.left.size, stitching.right.size), stitching.cut)}


def make_stitcher(method: str, stitching: Stitching) -> MiddleStitcher | PlaneStitcher:
    """The stitcher of that name. Raises BadArgument, listing the names, for an unknown one."""
    return by_name(STITCHERS, method, 'stitching method')(stitching)

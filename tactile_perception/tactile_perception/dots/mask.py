# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What of an image shows the sensor: a picture, or the corners of a polygon."""
from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..common.dots import Dots
from ..errors import BadArgument, BadFrame

_WHITE = 128  # grey levels, from which a pixel of a picture is the sensor: JPEG blurs black and white


class Mask:
    """Keeps detectors to the sensor.

    text: path of an image of the frames' size, white where the sensor is, or the corners x,y,x,y,... of a polygon, px. Raises BadArgument
    for a path without an image, fewer than three corners, and an image without white.
    """

    def __init__(self, text: str):
        self._text, self._corners, self._picture = text, _corners(text), None
        if self._corners is None:
            picture = cv2.imread(text, cv2.IMREAD_GRAYSCALE) if Path(text).is_file() else None
            if picture is None:
                raise BadArgument(f'parameter mask: {text!r} is neither an image file nor a polygon x,y,x,y,... of three corners and more')
            self._picture = (picture >= _WHITE).astype(np.uint8)
            if not self._picture.any():
                raise BadArgument(f'parameter mask: {text} has no white, which marks the sensor')
        self._inside, self._depth = None, None  # (H, W) uint8, and px from each pixel to the nearest outside

    def applied(self, image: np.ndarray) -> np.ndarray:
        """The image, uint8 (H, W) or (H, W, 3), with an even ground around the sensor, of the sensor's mean. Raises BadFrame for another
        size than the mask's, and where a polygon leaves nothing."""
        if self._inside is None or self._inside.shape != image.shape[:2]:
            self._inside = self._drawn(image.shape[:2])
            self._depth = cv2.distanceTransform(self._inside, cv2.DIST_L2, 5)
        ground = np.empty_like(image)
        ground[:] = np.rint(cv2.mean(image, self._inside)[:image.shape[2] if image.ndim == 3 else 1]).astype(np.uint8)
        return cv2.copyTo(image, self._inside, ground)

    def kept(self, dots: Dots) -> Dots:
        """Those of the dots in the applied image that lie within the mask as a whole; at its border some are cut."""
        column, row = np.rint(dots.uv).astype(int).clip(0, np.array(self._inside.shape[::-1]) - 1).T
        whole = self._depth[row, column] > np.sqrt(dots.area / np.pi)
        return Dots(dots.uv[whole], dots.area[whole], dots.sigma[whole])

    def _drawn(self, shape: tuple[int, int]) -> np.ndarray:
        size = f'{shape[1]} x {shape[0]} px'
        if self._picture is None:
            drawn = cv2.fillPoly(np.zeros(shape, np.uint8), [np.rint(self._corners).astype(np.int32)], 1)
            if not drawn.any():
                raise BadFrame(f'parameter mask: the polygon {self._text} lies outside the images of {size}')
            return drawn
        if self._picture.shape != shape:
            rows, columns = self._picture.shape
            raise BadFrame(f'parameter mask: {self._text} is {columns} x {rows} px, the images are {size}; draw it on one of them')
        return self._picture


def _corners(text: str) -> np.ndarray | None:
    """(N, 2) px of 'x,y,x,y,...'; None for what is no list of numbers. Raises BadArgument for too few or an odd number."""
    try:
        numbers = np.array([float(word) for word in text.split(',')])
    except ValueError:
        return None
    if len(numbers) < 6 or len(numbers) % 2 or not (np.abs(numbers) < 1e6).all():
        raise BadArgument(f'parameter mask: a polygon needs three corners and more, x,y,x,y,x,y,... in px, not {text!r}')
    return numbers.reshape(-1, 2)

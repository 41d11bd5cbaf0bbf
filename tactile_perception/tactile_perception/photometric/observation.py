# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What an image shows against the untouched gel: the relative change of its colours, and where printed markers hide the skin."""
from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np

from .constants import PHOTOMETRIC


def to_working_size(image: np.ndarray) -> np.ndarray:
    """An image (H, W, 3), reduced by averaging to the working width where it is wider; float32."""
    height, width = image.shape[:2]
    if width > PHOTOMETRIC.width_px:
        image = cv2.resize(image, (PHOTOMETRIC.width_px, round(height * PHOTOMETRIC.width_px / width)), interpolation=cv2.INTER_AREA)
    return image.astype(np.float32)


def relative_change(image: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Change of the levels of an image (H, W, 3) from a reference (H, W, 3), relative to that."""
    return (image - reference) / (reference + PHOTOMETRIC.dark_levels)


def ink(image: np.ndarray) -> np.ndarray:
    """(H, W) bool: pixels of a working image that printed markers darken, with a border of one pixel."""
    grey = cv2.transform(image, np.full((1, 3), 1 / 3, np.float32))
    side = int(PHOTOMETRIC.marker_neighbourhood * image.shape[1]) | 1
    around = cv2.medianBlur(np.clip(grey, 0, 255).astype(np.uint8), side)
    return cv2.dilate((grey < PHOTOMETRIC.marker_brightness * around).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


class Background:
    """The untouched gel.

    Parameters
    ----------
    image : ndarray, shape (H, W, 3)
        Working image, BGR, grey levels.
    """

    def __init__(self, image: np.ndarray):
        self.image = image

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the working image."""
        return self.image.shape[:2]

    @cached_property
    def ink(self) -> np.ndarray:
        """(H, W) bool: pixels of markers."""
        return ink(self.image)

    @cached_property
    def _blurred(self) -> np.ndarray:
        return _smooth(self.image)

    def change(self, image: np.ndarray) -> np.ndarray:
        """(H, W, 3) float32: change of the levels of a working image, relative to the untouched gel."""
        return relative_change(_smooth(image), self._blurred)

    def hidden(self, image: np.ndarray) -> np.ndarray:
        """(H, W) bool: where a marker covers the skin, in this image or in that of the untouched gel. A gel without markers has none."""
        return self.ink | ink(image) if self.ink.any() else self.ink


def _smooth(image: np.ndarray) -> np.ndarray:
    return cv2.GaussianBlur(image, (0, 0), 0.8)  # noise of neighbouring pixels, at half of a working pixel's own blur

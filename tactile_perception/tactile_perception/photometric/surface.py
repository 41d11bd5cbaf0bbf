# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From slopes to depth: the surface whose slopes fit best in the sense of least squares.

The normal equations are Poisson's equation with the slope given at the border, which the cosine transform solves exactly [1]_.

.. [1] T. Simchony, R. Chellappa and M. Shao, Direct analytical methods for solving Poisson equations in computer vision problems, 1990.
"""
from __future__ import annotations

import cv2
import numpy as np
from scipy.fft import dctn, idctn

from .constants import PHOTOMETRIC


def fill_hidden(slope: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    """Slopes (H, W, 2) with hidden pixels, (H, W) bool, filled in by the mean of the pixels around them."""
    left, top, columns, rows = cv2.boundingRect(hidden.astype(np.uint8))
    if not columns:
        return slope
    margin = round(4 * PHOTOMETRIC.filled_px)
    near = tuple(slice(max(first - margin, 0), first + size + margin) for first, size in ((top, rows), (left, columns)))
    weight = np.where(hidden[near], np.float32(0), np.float32(1))
    around = cv2.GaussianBlur(slope[near] * weight[..., None], (0, 0), PHOTOMETRIC.filled_px) / np.maximum(
        cv2.GaussianBlur(weight, (0, 0), PHOTOMETRIC.filled_px), 1e-3)[..., None]
    filled = slope.copy()
    filled[near][hidden[near]] = around[hidden[near]]
    return filled


def bend(slope: np.ndarray) -> np.ndarray:
    """(H, W) float32, 1/px: second derivative of the depth along the steepest descent, of slopes (H, W, 2).

    Where the skin lies on an object it is curved as the object is, mostly outwards. Beside the object it curves back to flat: the bend
    changes its sign at the border of the contact.
    """
    along_x, along_y = (cv2.Sobel(slope, cv2.CV_32F, *order, scale=1 / 8) for order in ((1, 0), (0, 1)))
    curvature = np.dstack([along_x[..., 0], along_y[..., 1], 0.5 * (along_x[..., 1] + along_y[..., 0])])
    xx, yy, xy = cv2.split(cv2.GaussianBlur(curvature, (0, 0), PHOTOMETRIC.bend_px))
    x, y = cv2.split(cv2.GaussianBlur(slope, (0, 0), PHOTOMETRIC.bend_px))
    level = np.float32(PHOTOMETRIC.level_slope)
    return (x * x * xx + y * y * yy + 2 * x * y * xy + 0.5 * level * (xx + yy)) / (x * x + y * y + level)


class Integrator:
    """Integrates slopes over images of one shape (rows, columns)."""

    def __init__(self, shape: tuple[int, int]):
        self.shape = shape
        along = [2 * np.cos(np.pi * np.arange(count) / count) - 2 for count in shape]
        self._eigenvalues = (along[0][:, None] + along[1]).astype(np.float32)
        self._eigenvalues[0, 0] = 1.0  # of the mean height, which slopes do not show

    def depth(self, slope: np.ndarray) -> np.ndarray:
        """(H, W) float32 in px, with a mean of 0.

        Parameters
        ----------
        slope : ndarray, shape (H, W, 2)
            Change of depth from pixel to pixel along x and along y.
        """
        between_x, between_y = (slope[:, 1:, 0] + slope[:, :-1, 0]) / 2, (slope[1:, :, 1] + slope[:-1, :, 1]) / 2
        divergence = np.zeros(self.shape, np.float32)
        divergence[:, :-1] += between_x
        divergence[:, 1:] -= between_x
        divergence[:-1] += between_y
        divergence[1:] -= between_y
        spectrum = dctn(divergence, norm='ortho', overwrite_x=True) / self._eigenvalues
        spectrum[0, 0] = 0.0
        return idctn(spectrum, norm='ortho', overwrite_x=True)

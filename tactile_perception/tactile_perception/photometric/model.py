# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The calibrated model of a photometric gel: change of colour in, depth of the skin out."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from ..core.calibration_file import AGAIN, fitted_arrays
from ..core.errors import BadCalibration
from .colour import FEATURES, features, image_positions
from .constants import PHOTOMETRIC
from .surface import Integrator, bend, fill_hidden

_FITTED = {'coefficients': (FEATURES, 2), 'noise': (3, 3), 'background': (None, None, 3), 'depth_sigma': (),
           'slope_error': (), 'position_sigma': (), 'skirt': ()}

_OPTIONAL = 'modulus', 'force_error', 'field', 'steepest'


def averaged(change: np.ndarray) -> np.ndarray:
    """Changes (H, W, 3), averaged over the window in which they are judged."""
    return cv2.blur(change, (PHOTOMETRIC.window_px, PHOTOMETRIC.window_px))


@dataclass(frozen=True)
class DepthModel:
    """What calibrate fits.

    coefficients: (FEATURES, 2), of the slope; noise: (3, 3), covariance of the averaged change of an untouched skin; background: (h, w, 3),
    the untouched gel, small; depth_sigma: standard deviation of the depth of an untouched skin, in widths of the image; slope_error: that
    of a depth, relative to it; position_sigma: that of a contact's position, one coordinate, in widths of the image; skirt: length, in
    widths of the image, whose square is the depth of the skin beside an object over its bend; modulus: Pa, of ForceLaw, and force_error:
    relative standard deviation of a force; field: m, width of what the images show; steepest: slope, of the presses; 0: unknown.
    """

    coefficients: np.ndarray
    noise: np.ndarray
    background: np.ndarray
    depth_sigma: float
    slope_error: float
    position_sigma: float
    skirt: float
    modulus: float = 0.0
    force_error: float = 0.0
    field: float = 0.0
    steepest: float = 0.0

    @classmethod
    def from_dict(cls, fitted: Mapping, path: str) -> DepthModel:
        """Of the fitted values of a calibration file. Raises BadCalibration for values that make no model."""
        found = fitted_arrays(fitted, _FITTED | {name: () for name in _OPTIONAL if name in fitted}, path)
        eigenvalues = np.linalg.eigvalsh(found['noise'])
        sigmas = [found[name] for name in ('depth_sigma', 'slope_error', 'position_sigma', 'skirt')]
        if not (eigenvalues > 0).all() or not min(sigmas) > 0:
            raise BadCalibration(f'{path}: standard deviations, noise and skirt must be above 0; {AGAIN}')
        return cls(**found)

    def is_changed(self, change: np.ndarray) -> np.ndarray:
        """(H, W) bool: where changes (H, W, 3) of colour are more than the noise of an untouched skin."""
        white = cv2.transform(averaged(change), np.linalg.inv(np.linalg.cholesky(self.noise)).astype(np.float32))
        return cv2.transform(white * white, np.ones((1, 3), np.float32)) > PHOTOMETRIC.max_flat_distance


class Reconstruction:
    """Depth of images of one shape (rows, columns) by a DepthModel."""

    def __init__(self, model: DepthModel, shape: tuple[int, int]):
        self._model, self._integrator, self._position = model, Integrator(shape), image_positions(shape)
        self._coefficients = model.coefficients.astype(np.float32)

    def process(self, change: np.ndarray, hidden: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Depth (H, W) in px, 0 where the skin is untouched, its slope (H, W, 2), and where the skin has a slope at all (H, W) bool.

        Parameters
        ----------
        change : ndarray, shape (H, W, 3)
            Relative change of the colours.
        hidden : ndarray of bool, shape (H, W)
            Pixels that show no skin.
        """
        changed = self._model.is_changed(cv2.copyTo(change, (~hidden).view(np.uint8), np.zeros_like(change)) if hidden.any() else change)
        slope = np.zeros((*changed.shape, 2), np.float32)
        if not changed.any():
            return slope[..., 0], slope, changed
        seen = changed & ~hidden
        slope[seen] = features(change[seen], self._position[seen]) @ self._coefficients
        slope = fill_hidden(slope, hidden & changed)
        depth = self._integrator.depth(slope)
        some = depth[::4, ::4], changed[::4, ::4]  # the median of so many is the depth of the untouched skin
        untouched = some[0][~some[1]]
        return depth - np.float32(np.median(untouched if len(untouched) else depth)), slope, changed

    def touching(self, depth: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """(H, W) bool: where the skin lies on an object. It is dented by more than the noise, and than the error of the dent that it is in,
        and does not bend back to flat."""
        width, model = depth.shape[1], self._model
        dented = depth > PHOTOMETRIC.significant_sigmas * model.depth_sigma * width
        if not dented.any():
            return dented
        left, top, columns, rows = cv2.boundingRect(dented.astype(np.uint8))
        near = tuple(slice(max(first - PHOTOMETRIC.speckle, 0), first + size + PHOTOMETRIC.speckle)
                     for first, size in ((top, rows), (left, columns)))
        count, dents = cv2.connectedComponents(dented[near].astype(np.uint8))
        deepest = np.zeros(count, np.float32)
        np.maximum.at(deepest, dents[dents > 0], depth[near][dents > 0])
        lies = (depth[near] > PHOTOMETRIC.significant_sigmas * model.slope_error * deepest[dents]) & (
            bend(slope[near]) < PHOTOMETRIC.min_bend / (model.skirt * width)**2 * depth[near])
        found = np.zeros(depth.shape, bool)
        found[near] = cv2.medianBlur((lies & dented[near]).astype(np.uint8), PHOTOMETRIC.speckle) > 0
        return found

    def uncertain_depth(self, slope: np.ndarray, mask: np.ndarray) -> float:
        """Depth in px that a contact, (H, W) bool, has by slopes beside it that are steeper than those of the calibration: their sum over
        the length of its border."""
        if not self._model.steepest:
            return 0.0
        steep = cv2.magnitude(slope[..., 0], slope[..., 1]) > self._model.steepest
        if not steep.any():
            return 0.0
        side = 2 * round(PHOTOMETRIC.dent_skirts * self._model.skirt * mask.shape[1]) + 1
        steep &= cv2.dilate(mask.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))) > 0
        return float(np.hypot(*slope[steep].T).sum() / np.sqrt(4 * np.pi * np.count_nonzero(mask)))


def deeper_half(depth: np.ndarray, mask: np.ndarray) -> tuple[float, np.ndarray]:
    """Depth of the deepest point of a mask, and column and row of the centre of what is deeper than half of that."""
    deepest = float(cv2.blur(depth, (3, 3))[mask].max())
    row, column = np.nonzero(mask & (depth > 0.5 * deepest))
    weight = depth[row, column].astype(float) - 0.5 * deepest
    return deepest, np.array([column @ weight, row @ weight]) / weight.sum()

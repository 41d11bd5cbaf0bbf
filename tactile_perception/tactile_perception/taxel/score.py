# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact score of each taxel: pressure relative to the local level, with the threshold that the pad's mechanics gives."""
from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from scipy.linalg.lapack import dposv

from .array import SoftPad, TaxelArray

LEVEL = 0.5  # score at the border of a contact
# Pressure under a bonded elastic layer at the border of a rigid face pressed on it, as a part of that under its inside: 0.59 to 0.63 at
# Poisson ratios of 0.3 to 0.4, whatever the face's width (2.5 to 20 thicknesses) and the load; under 0.6 where the layer can hardly shrink.
BORDER_SHARE = 0.6
_SMOOTH = 0.5  # thicknesses, of the Gaussian that averages noise, differences of gain and roughness. Chosen
_NOISE = 10.0  # standard deviations of the noise, least level. Chosen
_GAP = 0.35  # of the level, down to which a dip in a contact is closed. Chosen: well below BORDER_SHARE
_ENOUGH = 16  # taxels in a patch, from which its level is fitted. Chosen: over two for each of the 6 coefficients
_CURVED = 0.5  # part of the plane's residual variance that a quadratic must explain to be used. Chosen
_LEAST, _MOST = 0.3, 1.7  # bounds of the level relative to a patch's mean. Chosen
_WIDEST = 15  # taxels, whose square an 8-bit sum can hold
_SAMPLE = 1500  # taxels of a patch used for the fit: bounds the time. Chosen


class ContactScore:
    """Scores of taxels, above LEVEL in contact; linear in pressure, so that the contour at LEVEL is the border.

    The pad spreads pressure over about its thickness. At the border of a face it falls to a fixed part of the level inside (BORDER_SHARE),
    whatever the load, and that is the threshold. The level is a plane, or a quadratic under a curved face, fitted to each patch.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._smooth = max(_SMOOTH * pad.thickness / array.pitch, 0.5)
        reach = max(1, round(pad.thickness / array.pitch))
        self._reach, self._join = reach, (min(2 * ((reach + 1) // 2) + 1, _WIDEST),) * 2

    def compute(self, pressure: np.ndarray, sigma: float) -> np.ndarray:
        """Scores (rows, columns) float32, 0 to 1, of pressure (rows, columns) float32; sigma: its noise, in the same unit."""
        least = np.float32(_NOISE * sigma)
        if not pressure.max() > BORDER_SHARE * least:
            return np.zeros_like(pressure)
        nearby = np.maximum(self._nearby(cv2.GaussianBlur(pressure, (0, 0), self._smooth)), least)
        touched = (pressure > BORDER_SHARE * nearby).view(np.uint8)
        # Soft thresholds: hard ones would shift level and border as a contact moves by parts of a taxel.
        soft = _clipped(pressure / nearby * 2.5 - 1)
        inner = _clipped(cv2.GaussianBlur(soft, (0, 0), self._smooth, borderType=cv2.BORDER_REPLICATE) * 5 - 3.75)
        level = self._patches(pressure, touched, inner, nearby)
        return _closed(_clipped(pressure / (2 * BORDER_SHARE * np.maximum(level, least))))

    def _nearby(self, smooth: np.ndarray) -> np.ndarray:
        """(rows, columns): the largest pressure within a thickness, extrapolated to the border by its change over another one."""
        reach = self._reach
        wide = largest_near(cv2.copyMakeBorder(smooth, reach, reach, reach, reach, cv2.BORDER_REPLICATE), reach)
        far = np.maximum(wide[2 * reach:], wide[:-2 * reach])
        near = wide[reach:-reach, reach:-reach]
        return np.maximum(near + near - np.maximum(far[:, 2 * reach:], far[:, :-2 * reach]), np.float32(_LEAST) * near)

    def _patches(self, pressure: np.ndarray, touched: np.ndarray, inner: np.ndarray, nearby: np.ndarray) -> np.ndarray:
        """(rows, columns): nearby, replaced by the fitted level on and around each patch."""
        count, labels, boxes, _ = cv2.connectedComponentsWithStats(self._joined(touched), connectivity=8)
        level = nearby
        for label in range(1, count):
            left, top, width, height, size = boxes[label].tolist()
            if size < _ENOUGH:
                continue
            box = slice(max(top - 1, 0), top + height + 1), slice(max(left - 1, 0), left + width + 1)
            patch = labels[box] == label
            fitted = _fitted(pressure[box], inner[box] * patch)
            if fitted is not None:
                np.copyto(level[box], fitted, where=self._joined(patch.view(np.uint8)) > 0)
        return level

    def _joined(self, mask: np.ndarray) -> np.ndarray:
        """(rows, columns) uint8, positive within reach of mask (rows, columns) uint8."""
        return cv2.boxFilter(mask, -1, self._join, normalize=False, borderType=cv2.BORDER_CONSTANT)


def _clipped(values: np.ndarray) -> np.ndarray:
    """values clipped to 0 to 1, in place."""
    np.maximum(values, 0, out=values)
    return np.minimum(values, 1, out=values)


def _fitted(pressure: np.ndarray, inside: np.ndarray) -> np.ndarray | None:
    """Level (rows, columns) of a patch from its inside (rows, columns), weights of 0 to 1; None where that is too small."""
    if np.count_nonzero(inside) < _ENOUGH:
        return None
    step = max(1, round((pressure.size / _SAMPLE)**0.5))
    y, x, terms = _grid(*pressure.shape, step)
    value, weight = pressure[::step, ::step].ravel(), inside[::step, ::step].ravel()
    weighed = terms * weight
    normal, sums, square = (weighed @ terms.T).astype(float), (weighed @ value).astype(float), float(weight @ (value * value))
    mean = sums[0] / normal[0, 0]
    normal.ravel()[::7] += 1e-6 * len(value)
    share, bent = dposv(normal[:3, :3], sums[:3])[1], dposv(normal, sums)[1]
    if square - bent @ sums >= (1 - _CURVED) * (square - share @ sums[:3]):
        bent = np.array([*share, 0, 0, 0])
    one, down, across, twice_down, both, twice_across = np.float32(bent)
    level = (one + (down + twice_down * y) * y) + (across + twice_across * x) * x
    if both:
        level += (both * y) * x
    return np.minimum(np.maximum(level, np.float32(_LEAST * mean)), np.float32(_MOST * mean))


@lru_cache(maxsize=64)
def _grid(rows: int, columns: int, step: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """y (rows, 1) and x (1, columns) from -1 to 1, and (6, M) 1, y, x, yy, xy, xx at each step-th of both."""
    y, x = np.ogrid[-1:1:rows * 1j, -1:1:columns * 1j]
    y, x = y.astype(np.float32), x.astype(np.float32)
    down, across = (values.ravel() for values in np.broadcast_arrays(y[::step], x[:, ::step]))
    return y, x, np.stack([np.ones_like(down), down, across, down * down, across * down, across * across])


def _closed(score: np.ndarray) -> np.ndarray:
    """score with dips filled in which pressure stays above _GAP of the level: a rough face, no hole."""
    low = (score <= LEVEL).view(np.uint8)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(low, connectivity=4)
    if count <= 2:
        return score
    rows, columns = score.shape
    left, top, width, height = boxes[:, :4].T
    inner = (left > 0) & (top > 0) & (left + width < columns) & (top + height < rows)
    inner[0] = False
    if not inner.any():
        return score
    free = np.zeros(count, bool)
    free[labels[score < _GAP / (2 * BORDER_SHARE)]] = True
    dip = inner & ~free
    if dip.any():
        score[dip[labels]] = 1
    return score


def largest_near(values: np.ndarray, reach: int) -> np.ndarray:
    """(rows, columns): the largest of values (rows, columns) within reach taxels along both axes."""
    largest = cv2.copyMakeBorder(values, reach, reach, reach, reach, cv2.BORDER_REPLICATE)
    have, size = 1, 2 * reach + 1  # taxels over which it is the largest; quicker than OpenCV's on a small picture
    while have < size:
        step = min(have, size - have)
        largest = np.maximum(largest[step:], largest[:-step])
        largest = np.maximum(largest[:, step:], largest[:, :-step])
        have += step
    return largest

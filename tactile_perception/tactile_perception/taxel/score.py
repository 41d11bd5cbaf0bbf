# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which taxels are touched: pressure against the local level, where the pad's mechanics say the border is."""
from __future__ import annotations

import cv2
import numpy as np

from .array import SoftPad, TaxelArray

LEVEL = 0.5  # of a score, on the border of a contact
# Pressure under a bonded elastic layer at the border of a rigid face pressed on it, as a part of that under its inside: 0.59 to 0.63 at
# Poisson ratios of 0.3 to 0.4, whatever the face's width (2.5 to 20 thicknesses) and the load; under 0.6 where the layer can hardly shrink.
BORDER_SHARE = 0.6
_SMOOTH = 0.5  # thicknesses, of the level nearby: it must not follow noise, differences of gain and roughness
_NOISE = 10.0  # standard deviations: no level is lower
_GAP = 0.35  # of the level: where pressure does not fall to this between touched taxels, they are one contact
_ENOUGH = 16  # taxels inside a patch, from which its level is a fitted plane
_CURVED = 0.5  # share of what a plane leaves of the variance that a parabola must explain, to be the level
_LEAST, _MOST = 0.3, 1.7  # of a patch's mean, bounds of the level
_FAR = 4  # taxels
_SAMPLE = 1500  # taxels of a patch that are used


class ContactScore:
    """Scores of taxels, over LEVEL in contact; linear in pressure between taxels, so that its contour is the border.

    The pad spreads pressure over about its thickness. Under a face that ends, it has fallen to a fixed part of the level inside
    (BORDER_SHARE), whatever the load; that, and no fixed value, is the threshold. The level is a plane (a parabola where pressure is
    curved, as under a ball) fitted to the inside of each patch, so that a rough face has a smooth border.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        self._smooth = max(_SMOOTH * pad.thickness / array.pitch, 0.5)
        reach = max(1, round(pad.thickness / array.pitch))
        self._reach, self._join = reach, (reach + 1) // 2

    def of(self, pressure: np.ndarray, sigma: float) -> np.ndarray:
        """(rows, columns) float32, 0 to 1, from pressure (rows, columns) float32 in any unit, with noise of sigma in the same."""
        smooth = cv2.GaussianBlur(pressure, (0, 0), self._smooth)
        nearby = np.maximum(self._nearby(smooth), _NOISE * sigma)
        touched = (pressure > BORDER_SHARE * nearby).view(np.uint8)
        if not touched.any():
            return pressure * np.float32(0)
        # Steps over taxels would shift the level, and the border with it, as a contact moves between them.
        soft = np.clip(pressure / nearby * 2.5 - 1, 0, 1)
        inner = np.clip(cv2.GaussianBlur(soft, (0, 0), self._smooth, borderType=cv2.BORDER_REPLICATE) * 5 - 3.75, 0, 1)
        level = self._patches(pressure, touched, inner, nearby)
        score = pressure / (2 * BORDER_SHARE * np.maximum(level, _NOISE * sigma))
        np.clip(score, 0, 1, out=score)
        return _closed(score)

    def _nearby(self, smooth: np.ndarray) -> np.ndarray:
        """(rows, columns): the largest pressure within a thickness, gone on with to the border by how it changes over another one."""
        near = largest_near(smooth, self._reach)
        return np.maximum(2 * near - largest_near(near, self._reach), _LEAST * near)

    def _patches(self, pressure: np.ndarray, touched: np.ndarray, inner: np.ndarray, nearby: np.ndarray) -> np.ndarray:
        """(rows, columns): nearby with the fitted level on each patch and around it."""
        count, labels, boxes, _ = cv2.connectedComponentsWithStats(largest_near(touched, self._join), connectivity=8)
        level = nearby
        for label in range(1, count):
            left, top, width, height, size = boxes[label]
            if size < _ENOUGH:
                continue
            box = slice(max(top - 1, 0), top + height + 1), slice(max(left - 1, 0), left + width + 1)
            patch = (labels[box] == label).astype(np.uint8)
            fitted = _fitted(pressure[box], inner[box] * patch)
            if fitted is not None:
                mine = largest_near(patch, self._join) > 0
                level[box] = np.where(mine, fitted, level[box])
        return level


def _fitted(pressure: np.ndarray, inside: np.ndarray) -> np.ndarray | None:
    """Level (rows, columns) of a patch from its inside (rows, columns), weights of 0 to 1; None where that is too small."""
    row, column = np.nonzero(inside)
    if len(row) < _ENOUGH:
        return None
    thin = slice(None, None, max(1, len(row) // _SAMPLE))
    row, column = row[thin], column[thin]
    value, weight = pressure[row, column].astype(float), inside[row, column].astype(float)
    half = 0.5 * np.array(inside.shape) + 1e-9
    plane = _terms(row / half[0] - 1, column / half[1] - 1)
    grid = _terms(*np.ogrid[-1:1:inside.shape[0] * 1j, -1:1:inside.shape[1] * 1j])
    mean = float(weight @ value / weight.sum())
    weighed = plane * weight
    normal, sums, square = weighed @ plane.T, weighed @ value, float(weight @ value**2)
    normal[np.diag_indices(6)] += 1e-6 * len(value)
    share, bent = np.linalg.solve(normal[:3, :3], sums[:3]), np.linalg.solve(normal, sums)
    if square - bent @ sums < (1 - _CURVED) * (square - share @ sums[:3]):
        share = bent
    level = sum(factor * term for factor, term in zip(share, grid))
    return np.clip(level, _LEAST * mean, _MOST * mean).astype(np.float32)


def _terms(y, x) -> list:
    """1, y, x, yy, xy, xx."""
    one = np.ones_like(y * x)
    terms = [one, y * one, x * one, y * y * one, x * y, x * x * one]
    return np.array(terms) if y.ndim == 1 else terms


def _closed(score: np.ndarray) -> np.ndarray:
    """score with dips filled in which pressure does not fall to _GAP of the level: a rough face, no hole."""
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
    if reach > _FAR:
        return cv2.dilate(values, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    down = values.copy()
    for step in range(1, reach + 1):  # quicker than OpenCV on a small picture
        np.maximum(down[step:], values[:-step], out=down[step:])
        np.maximum(down[:-step], values[step:], out=down[:-step])
    across = down.copy()
    for step in range(1, reach + 1):
        np.maximum(across[:, step:], down[:, :-step], out=across[:, step:])
        np.maximum(across[:, :-step], down[:, step:], out=across[:, :-step])
    return across

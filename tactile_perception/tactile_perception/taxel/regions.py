# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: outlines with holes between the taxels, and their moments (paper taxel_array_image_processing, eqs 1
to 4, over the contact)."""
from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..contact.moments import Moments
from ..contact.outline import Outline, contour, group_loops
from .array import TaxelArray
from .score import LEVEL, largest_near

_AROUND = 2  # taxels beside a region that its force reaches
_MOST = 64  # regions, the largest: more is no contact, but a broken image


@dataclass(frozen=True)
class TaxelRegion:
    """One connected region.

    label: its number in the frame's labels; outline: with holes, m and (row, column); moments: of area, m; count: of taxels; force: sum of
    pressure times area over its taxels and those around, in the pressure's unit times m^2; pressure_centre: (2,) m; peak: pressure.
    """

    label: int
    outline: Outline
    moments: Moments
    count: int
    force: float
    pressure_centre: np.ndarray
    peak: float


@dataclass(frozen=True)
class Regions:
    """Of one frame. all: largest first; labels: (rows, columns) int32, 0 off contact."""

    all: list[TaxelRegion]
    labels: np.ndarray

    @property
    def total(self) -> Moments:
        """Moments of all regions together; there must be one."""
        return sum((region.moments for region in self.all[1:]), self.all[0].moments)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray) -> Regions:
    """The regions of score and pressure (rows, columns) float32."""
    touched = (score > LEVEL).astype(np.uint8)
    count, labels = cv2.connectedComponents(touched, connectivity=4)
    if count < 2:
        return Regions([], labels)
    loops = contour(cv2.copyMakeBorder(score, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0), LEVEL)
    loops = [loop - 1 for loop in loops]
    outlines = group_loops(loops, array.places(np.concatenate(loops)))[:_MOST]
    sums = _Sums(labels, count, pressure, array)
    regions = [sums.region(outline, _inside(outline.grid_points, labels)) for outline in outlines]
    return Regions([region for region in regions if region.moments.area > 0], labels)


def _inside(loop: np.ndarray, labels: np.ndarray) -> int:
    """Label of the taxel on the inner side of the loop's first vertex, which lies between two neighbours."""
    ends = [np.floor(loop[0]).astype(int), np.ceil(loop[0]).astype(int)]
    for row, column in ends:
        if 0 <= row < labels.shape[0] and 0 <= column < labels.shape[1] and labels[row, column]:
            return int(labels[row, column])
    return 0


class _Sums:
    """Sums of pressure by label."""

    def __init__(self, labels: np.ndarray, count: int, pressure: np.ndarray, array: TaxelArray):
        near = np.where(labels > 0, labels, largest_near(labels, _AROUND))
        flat, weight = near.ravel(), np.maximum(pressure, 0).ravel()
        self._array = array
        self.count = np.bincount(labels.ravel(), minlength=count)
        self.sum = np.bincount(flat, weight, count)
        rows, columns = array.shape
        self.x = np.bincount(flat, (np.maximum(pressure, 0) * array.x).ravel(), count)
        self.y = np.bincount(flat, (np.maximum(pressure, 0) * array.y[:, None]).ravel(), count)
        self._pressure, self._labels = pressure, labels

    def region(self, outline: Outline, label: int) -> TaxelRegion:
        total = self.sum[label]
        centre = np.array([self.x[label], self.y[label]]) / total if total > 0 else np.full(2, np.nan)
        row, column = outline.grid_points.astype(int).T
        box = slice(max(row.min(), 0), row.max() + 2), slice(max(column.min(), 0), column.max() + 2)
        peak = float(self._pressure[box][self._labels[box] == label].max(initial=0.0))
        return TaxelRegion(label, outline, flat_moments(outline), int(self.count[label]), float(total * self._array.taxel_area), centre,
                           peak)


def flat_moments(outline: Outline) -> Moments:
    """Area moments of a plane region, its holes taken off, from the polygons alone (Green's theorem)."""
    total = sum(_around(loop[:, 0], loop[:, 1]) for loop in outline.loops)
    area = float(total[0])
    return Moments(area, np.array([0.0, 0.0, area]), np.array([total[1], total[2], 0.0]), total[3:])


def _around(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(6,) integrals of 1, x, y, xx, xy, yy within a polygon that turns from +x to +y, exact."""
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    turn = x * y1 - x1 * y
    rows = np.empty((6, len(x)))
    rows[0], rows[1], rows[2] = 0.5, (x + x1) / 6, (y + y1) / 6
    rows[3] = (x * x + x * x1 + x1 * x1) / 12
    rows[4] = (x * y1 + 2 * x * y + 2 * x1 * y1 + x1 * y) / 24
    rows[5] = (y * y + y * y1 + y1 * y1) / 12
    return rows @ turn

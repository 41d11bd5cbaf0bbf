# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: outlines with holes between the taxels, and their moments (paper taxel_array_image_processing, eqs 1
to 4, over the contact)."""
from __future__ import annotations

import math
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

    label: its number in the frame's labels; box: rows and columns that it takes, as slices; outline: with holes, m and (row, column);
    moments: of area, m; count: of taxels; force: sum of pressure times area over its taxels and those around, in the pressure's unit times
    m^2; pressure_centre: (2,) m; peak: pressure.
    """

    label: int
    box: tuple[slice, slice]
    outline: Outline
    moments: Moments
    count: int
    force: float
    pressure_centre: np.ndarray
    peak: float


@dataclass(frozen=True)
class Regions:
    """Of one frame. all: largest first; labels: (rows, columns) int32, 0 off contact; touched: (rows, columns) bool, the rest."""

    all: list[TaxelRegion]
    labels: np.ndarray
    touched: np.ndarray

    @property
    def total(self) -> Moments:
        """Moments of all regions together; there must be one."""
        return sum((region.moments for region in self.all[1:]), self.all[0].moments)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray) -> Regions:
    """The regions of score and pressure (rows, columns) float32."""
    touched = score > LEVEL
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(touched.view(np.uint8), connectivity=4)
    if count < 2:
        return Regions([], labels, touched)
    left, top, width, height = cv2.boundingRect(touched.view(np.uint8))
    bordered = cv2.copyMakeBorder(score, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    loops = [loop + (top - 1, left - 1) for loop in contour(bordered[top:top + height + 2, left:left + width + 2], LEVEL)]
    outlines = group_loops(loops, array.places(np.concatenate(loops)))[:_MOST]
    near = np.where(touched, labels, largest_near(labels, _AROUND))
    regions = [_region(outline, labels, boxes, near, pressure, array) for outline in outlines]
    return Regions([region for region in regions if region.moments.area > 0], labels, touched)


def _region(outline: Outline, labels: np.ndarray, boxes: np.ndarray, near: np.ndarray, pressure: np.ndarray, array: TaxelArray):
    """The TaxelRegion in an outline; boxes: OpenCV's, of the labels; near: labels (rows, columns) gone on with to the taxels around."""
    label = _inside(outline.grid_points, labels)
    left, top, width, height, count = boxes[label].tolist()
    box = slice(top, top + height), slice(left, left + width)
    wide = slice(max(top - _AROUND, 0), box[0].stop + _AROUND), slice(max(left - _AROUND, 0), box[1].stop + _AROUND)
    load = np.maximum(pressure[wide], 0) * (near[wide] == label)
    total = float(load.sum())
    centre = np.array([load.sum(axis=0) @ array.x[wide[1]], load.sum(axis=1) @ array.y[wide[0]]]) / total if total > 0 else \
        np.full(2, np.nan)
    peak = float((pressure[box] * (labels[box] == label)).max())
    return TaxelRegion(label, box, outline, flat_moments(outline), count, total * array.taxel_area, centre, max(peak, 0.0))


def _inside(loop: np.ndarray, labels: np.ndarray) -> int:
    """Label of the taxel on the inner side of the loop's first vertex, which lies between two neighbours."""
    row, column = loop[0].tolist()
    for r, c in ((math.floor(row), math.floor(column)), (math.ceil(row), math.ceil(column))):
        if 0 <= r < labels.shape[0] and 0 <= c < labels.shape[1] and labels[r, c]:
            return int(labels[r, c])
    return 0


def flat_moments(outline: Outline) -> Moments:
    """Area moments of a plane region, its holes taken off, from the polygons alone (Green's theorem)."""
    area, first, second = (sum(parts) for parts in zip(*(_around(loop[:, :2]) for loop in outline.loops)))
    return Moments(float(area), np.array([0.0, 0.0, area]), np.array([*first, 0.0]), second)


def _around(points: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Integrals of 1, of (x, y) and of (xx, xy, yy) within a polygon (M, 2) that turns from +x to +y, exact."""
    ends = np.concatenate([points, np.concatenate([points[1:], points[:1]])], axis=1)  # x, y of each side's beginning and end
    turn = ends[:, 0] * ends[:, 3] - ends[:, 2] * ends[:, 1]
    sums = turn @ ends
    (xx, xy, xx1, xy1), (_, yy, yx1, yy1), (_, _, x1x1, x1y1), (_, _, _, y1y1) = (ends.T * turn) @ ends
    return 0.5 * float(turn.sum()), (sums[:2] + sums[2:]) / 6, np.array([2 * (xx + xx1 + x1x1), 2 * xy + xy1 + yx1 + 2 * x1y1,
                                                                       2 * (yy + yy1 + y1y1)]) / 24

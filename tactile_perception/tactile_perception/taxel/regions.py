# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: outlines with subtaxel accuracy and their moments (paper taxel_array_image_processing, eqs 1 to 3, with
I = 1 inside the outline)."""
from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from .array import TaxelArray
from .. import _core
from ..common.contour import Outline, grouped
from ..common.region_moments import Moments
from .score import LEVEL

_AROUND, _NEAR = 2, (5, 5)  # taxels around a region that share its force, and that square. Chosen: a pad of 2 mm on taxels of 1 mm (paper)
_MOST = 64  # regions; an image with more is broken. Chosen: more than fingers can make


@dataclass(frozen=True)
class TaxelRegion:
    """One connected region.

    label: in the frame's labels; box: its rows and columns, slices; outline: with holes; moments: of area; count: of taxels; force: sum of
    pressure times area over its taxels and those around, in the pressure's unit times m^2; pressure_centre: (2,) m; peak: largest pressure.
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
    """Regions of one frame. all: largest first; labels: (rows, columns) int32, 0 outside; touched: (rows, columns) bool, inside; near:
    labels extended to the taxels around, which share a region's force; broken: whether the image has more than 64 regions, of which all
    holds the largest."""

    all: list[TaxelRegion]
    labels: np.ndarray
    touched: np.ndarray
    near: np.ndarray
    broken: bool = False

    @property
    def total(self) -> Moments:
        """Moments of all regions together; requires at least one."""
        return sum((region.moments for region in self.all[1:]), self.all[0].moments)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray) -> Regions:
    """Regions where score (rows, columns) float32 exceeds LEVEL, with the load of pressure (rows, columns) float32."""
    touched = score > LEVEL
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(touched.view(np.uint8), connectivity=4)
    if count < 2:
        return Regions([], labels, touched, labels)
    if count > _MOST + 1:
        kept = np.zeros(count, bool)
        kept[1 + np.argsort(boxes[1:, cv2.CC_STAT_AREA], kind='stable')[-_MOST:]] = True
        score = score * kept[labels]
    left, top, width, height = cv2.boundingRect(touched.view(np.uint8))
    bordered = cv2.copyMakeBorder(score, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    places, *loops = _core.find_contours(bordered[top:top + height + 2, left:left + width + 2].astype(float), level=LEVEL)
    places += (top - 1, left - 1)
    outlines = grouped(places, array.places(places), *loops)
    near = _around_touched(touched) if count == 2 else np.where(touched, labels, _spread(labels))
    regions = [_region(outline, labels, boxes, near, pressure, array) for outline in outlines]
    return Regions([region for region in regions if region.moments.area > 0], labels, touched, near, count > _MOST + 1)


def _spread(labels: np.ndarray) -> np.ndarray:
    """labels (rows, columns), each the largest nearby."""
    return cv2.dilate(labels.astype(np.float32), np.ones(_NEAR, np.uint8)).astype(labels.dtype)


def _around_touched(touched: np.ndarray) -> np.ndarray:
    """touched (rows, columns) bool, dilated."""
    return cv2.boxFilter(touched.view(np.uint8), -1, _NEAR, normalize=False, borderType=cv2.BORDER_CONSTANT) > 0


def _region(outline: Outline, labels: np.ndarray, boxes: np.ndarray, near: np.ndarray, pressure: np.ndarray, array: TaxelArray):
    """The TaxelRegion of an outline; boxes: OpenCV's statistics of the labels; near: see Regions."""
    label = _inside(outline.grid_points, labels)
    left, top, width, height, count = boxes[label].tolist()
    wide = slice(max(top - _AROUND, 0), top + height + _AROUND), slice(max(left - _AROUND, 0), left + width + _AROUND)
    load = np.maximum(pressure[wide], 0) * (near[wide] == label)
    (total, x), (y, _) = (array.lever_y[wide[0]].T @ load @ array.lever_x[wide[1]]).tolist()
    centre = np.array([x, y]) / total if total > 0 else np.full(2, np.nan)
    return TaxelRegion(label, (slice(top, top + height), slice(left, left + width)), outline, flat_moments(outline, array), count,
                       total * array.taxel_area, centre, float(load.max()))


def _inside(loop: np.ndarray, labels: np.ndarray) -> int:
    """Label of the taxel on the inner side of the loop's first vertex."""
    row, column = loop[0].tolist()
    for r, c in ((math.floor(row), math.floor(column)), (math.ceil(row), math.ceil(column))):
        if 0 <= r < labels.shape[0] and 0 <= c < labels.shape[1] and labels[r, c]:
            return int(labels[r, c])
    return 0


def flat_moments(outline: Outline, array: TaxelArray) -> Moments:
    """Area moments of a plane region without its holes, from the polygons (Green's theorem)."""
    sums = _around(outline.points, array.pitch)
    for hole in outline.holes:
        sums = sums - _around(hole, array.pitch)
    area = float(sums[0]) * array.taxel_area
    first, second = sums[1:3] * array.pitch**3, sums[3:] * array.pitch**4
    return Moments(area, np.array([0.0, 0.0, area]), np.array([*first, 0.0]), second)


def _around(loop: np.ndarray, pitch: float) -> np.ndarray:
    """(6,) integrals of 1, x, y, xx, xy, yy within a polygon (M, 3) m, in pitches: cv2.moments rounds tiny areas to 0."""
    found = cv2.moments((loop[:, None, :2] * (1 / pitch)).astype(np.float32))
    return np.array([found[name] for name in ('m00', 'm10', 'm01', 'm20', 'm11', 'm02')])

# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact regions of a taxel image: contact score, outlines with subtaxel accuracy and their moments (paper taxel_array_image_processing,
eqs 1 to 3, with I = 1 inside the outline)."""
from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from .._core import taxel as _kernel
from .pressure import SoftPad, TaxelArray, grown
from ..common.surface import Moments, Outline, grouped

LEVEL = 0.5  # score at the border of a contact
NOISE = 10.0  # standard deviations of the noise, least level: a false taxel in a hundred thousand frames, also of correlated noise
# Pressure under a bonded elastic layer at the border of a rigid face pressed on it, as a part of that under its inside: 0.59 to 0.63 at
# Poisson ratios of 0.3 to 0.4, whatever the face's width (2.5 to 20 thicknesses) and the load; under 0.6 where the layer can hardly shrink.
BORDER_SHARE = 0.6
# Thicknesses: pressure at the border of a curved face over the slope with which the fitted level runs out to zero there. By theory at most
# 0.22, 1 / sqrt(2 pi) of the width of the Gaussian by which the pad blurs pressure; less, since the pad stiffens under deep presses and its
# pressure runs out more gently than a paraboloid.
_BORDER_RAMP = 0.165
_SMOOTH = 0.5  # thicknesses, of the Gaussian that averages noise, differences of gain and roughness
_AROUND = 2  # taxels around a region that share its force: a pad of 2 mm on taxels of 1 mm (paper)
_MOST = 64  # regions; an image with more is broken: more than fingers can make
_LEAST = 0.25  # taxels, area of a piece: half of what a single taxel of full score has; noise at a border makes smaller ones


class ContactScore:
    """Scores of taxels, above LEVEL in contact; linear in pressure, so that the contour at LEVEL is the border.

    The pad spreads pressure over about its thickness. At the border of a flat face it falls to a fixed part of the level inside
    (BORDER_SHARE), whatever the load; under a curved face the level itself runs out, and a part of its slope is left. The level is a plane,
    or a quadratic, fitted to each patch.
    """

    def __init__(self, array: TaxelArray, pad: SoftPad):
        thickness = pad.thickness / array.pitch
        self._rule = {'smooth': max(_SMOOTH * thickness, 0.5), 'reach': min(max(1, round(thickness)), max(array.shape)),
                      'share': BORDER_SHARE, 'ramp': _BORDER_RAMP * thickness}

    def compute(self, pressure: np.ndarray, sigma: float, full: np.ndarray | None = None) -> np.ndarray:
        """Scores (rows, columns) float32, 0 to 1, of pressure (rows, columns) float32; sigma: its noise, in the same unit; full: (rows,
        columns) bool, taxels that are saturated, None for none."""
        least = NOISE * sigma
        full = np.zeros(pressure.shape, bool) if full is None else full
        return _kernel.contact_score(pressure, full, least=least if math.isfinite(least) else 1e30, **self._rule)


@dataclass(frozen=True)
class TaxelRegion:
    """One region, of one piece or of several.

    label: in the frame's labels; box: its rows and columns, slices; outlines: of its pieces, with holes; moments: of area; count: of
    taxels; force: sum of pressure times area over its taxels and those around, in the pressure's unit times m^2; peak: largest
    pressure.
    """

    label: int
    box: tuple[slice, slice]
    outlines: list[Outline]
    moments: Moments
    count: int
    force: float
    peak: float


@dataclass(frozen=True)
class Regions:
    """Regions of one frame. all: largest first; labels: (rows, columns) int32, 0 outside; touched: (rows, columns) bool, in contact; near:
    labels extended to the taxels around, which share a region's force; broken: whether the image has more than 64 regions, of which all
    and labels hold the largest."""

    all: list[TaxelRegion]
    labels: np.ndarray
    touched: np.ndarray
    near: np.ndarray
    broken: bool = False

    @property
    def total(self) -> Moments:
        """Moments of all regions together; requires at least one."""
        return sum((region.moments for region in self.all[1:]), self.all[0].moments)


def find_regions(score: np.ndarray, pressure: np.ndarray, array: TaxelArray, reach: float = 0.0) -> Regions:
    """Regions where score (rows, columns) float32 exceeds LEVEL, with the load of pressure (rows, columns) float32; reach: taxels. Pieces
    nearer to each other are one region: a pad hands on the pressure of two objects nearer than its thickness as that of one."""
    touched = score > LEVEL
    if not touched.any():
        return Regions([], np.zeros(score.shape, np.int32), touched, np.zeros(score.shape, np.int32))
    count, labels = cv2.connectedComponents(touched.view(np.uint8), connectivity=4)
    broken = count - 1 > _MOST
    if broken:
        largest = 1 + np.argsort(-np.bincount(labels.ravel())[1:], kind='stable')[:_MOST]
        labels[~np.isin(labels, largest)] = 0
        score = score * (labels > 0)
    elif count > 2:  # one outline surrounds taxels that meet at a corner, too
        _, labels = cv2.connectedComponents(grown(touched, round(0.5 * reach)).view(np.uint8))
        labels *= touched
    around = cv2.dilate(labels.astype(np.float32), np.ones((2 * _AROUND + 1,) * 2, np.uint8)).astype(np.int32)
    near = np.where(labels > 0, labels, around)
    regions = [_region(label, pieces, labels, (near, pressure), array) for label, pieces in _pieces(score, labels, array).items()]
    return Regions(sorted(regions, key=lambda region: -region.moments.area), labels, touched, near, broken)


def _pieces(score: np.ndarray, labels: np.ndarray, array: TaxelArray) -> dict[int, list[tuple[Outline, np.ndarray]]]:
    """Label -> outlines of its pieces, largest first, and the integrals (6,) within each, without its holes."""
    loops = _kernel.outlines(score, labels, level=LEVEL, pitch=array.pitch)
    region, found = loops.region, {}
    first = np.flatnonzero(np.diff(region, prepend=-1))  # loop of each outline; its holes follow
    integrals = np.add.reduceat(np.array(loops.integrals), first)
    for k, outline, sums in zip(first.tolist(), grouped(loops.grid, loops.points, loops.start, region), integrals):
        if sums[0] > _LEAST * array.taxel_area:
            found.setdefault(loops.label[k], []).append((outline, sums))
    return found


def _region(label: int, pieces: list, labels: np.ndarray, load: tuple[np.ndarray, np.ndarray], array: TaxelArray) -> TaxelRegion:
    """load: (rows, columns) labels of the taxels that share the load, and pressure."""
    corners = np.concatenate([outline.grid_points for outline, _ in pieces])
    low, high = np.maximum(np.ceil(corners.min(axis=0)), 0).astype(int), np.floor(corners.max(axis=0)).astype(int) + 1
    wide = tuple(slice(max(a - _AROUND, 0), b + _AROUND) for a, b in zip(low, high))
    near, pressure = load
    pressed = np.maximum(pressure[wide][near[wide] == label], 0)
    box = slice(int(low[0]), int(high[0])), slice(int(low[1]), int(high[1]))
    area, first_x, first_y, *second = sum(sums for _, sums in pieces).tolist()
    moments = Moments(area, np.array([0.0, 0.0, area]), np.array([first_x, first_y, 0.0]), np.array(second))
    return TaxelRegion(label, box, [outline for outline, _ in pieces], moments, int(np.count_nonzero(labels[box] == label)),
                       float(pressed.sum(dtype=float)) * array.taxel_area, float(pressed.max(initial=0)))
